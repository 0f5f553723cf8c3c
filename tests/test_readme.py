"""What README, docs and the other pages show is true: code runs, settings exist, links lead somewhere."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path
from typing import Any, get_type_hints

import pytest
import torch
import yaml

from mrhubo.config import Config, load_config

ROOT = Path(__file__).resolve().parent.parent
DOCS = sorted((ROOT / "docs").rglob("*.md"))
TOP = [
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")),
    *(ROOT / folder / "README.md" for folder in ("mlruns", "data/motions")),
]
MAX_README_LINES = 110


def blocks(path: Path, language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", path.read_text(), re.S)


def name_of(path: Path) -> str:
    return str(path.relative_to(ROOT))


@pytest.mark.parametrize("page", ["docs/python.md", "docs/prior.md"])
def test_the_priors_code_runs(root: Path, page: str) -> None:
    (code,) = [block for block in blocks(root / page, "python") if "BodyPrior.open" in block]
    names: dict[str, object] = {}
    exec(code, names)
    pose = names["pose"]
    assert isinstance(pose, torch.Tensor) and pose.shape == (1, 21, 6) and bool(pose.isfinite().all())


def test_the_readmes_robot_is_the_shipped_one(root: Path) -> None:
    (shown,) = blocks(root / "README.md", "yaml")
    assert yaml.safe_load(shown) == yaml.safe_load((root / "conf" / "nao.yaml").read_text())


def test_the_robots_page_shows_settings_that_exist(root: Path, tmp_path: Path) -> None:
    whole, ranges, trainer = blocks(root / "docs" / "robots.md", "yaml")
    (tmp_path / "myrobot.yaml").write_text(f"{whole}{ranges}{trainer}")
    config = load_config(tmp_path / "myrobot.yaml")
    assert config.robot.name == "myrobot" and config.trainer.max_steps == 12000
    assert set(config.robot.ranges) <= set(config.robot.joints)


def test_the_official_files_settings_are_keys(root: Path, tmp_path: Path) -> None:
    (settings,) = blocks(root / "docs" / "official-files.md", "yaml")
    robot = (root / "conf" / "nao.yaml").read_text().replace("../data", str(root / "data"))
    (tmp_path / "nao.yaml").write_text(f"{robot}\n{settings}")
    config = load_config(tmp_path / "nao.yaml")
    assert config.body.prior == "vposer" and config.body.betas == [0.3, -1.2]


def default_of(field: dataclasses.Field[Any]) -> Any:
    return field.default_factory() if callable(field.default_factory) else field.default


def test_the_settings_page_lists_every_key_with_its_default(root: Path) -> None:
    rows = re.findall(r"^\| `([\w.]+)` \| (.+?) \|", (root / "docs" / "configuration.md").read_text(), re.M)
    shown = dict(rows)
    expected = {
        f"{section}.{field.name}": default_of(field)
        for section, kind in get_type_hints(Config).items()
        if section != "robot"
        for field in dataclasses.fields(kind)
    }
    assert len(rows) == len(shown) and shown.keys() == expected.keys()
    for key, default in expected.items():
        words = "none" if default is None else f"[{', '.join(default)}]" if isinstance(default, list) else str(default)
        assert shown[key].strip("`") == (words.lower() if isinstance(default, bool) else words), key


def test_the_robots_page_tells_of_every_key_of_a_robot(root: Path) -> None:
    text = (root / "docs" / "robots.md").read_text()
    headings = re.findall(r"^## (.*)$", text, re.M)
    told = {word.strip() for heading in headings for word in heading.split(",")}
    assert {field.name for field in dataclasses.fields(get_type_hints(Config)["robot"])} <= told


def test_the_readme_is_short(root: Path) -> None:
    assert len((root / "README.md").read_text().splitlines()) <= MAX_README_LINES


def slug(heading: str) -> str:
    """The anchor of a heading, as code hosts and MkDocs make it."""
    return re.sub(r"[\s-]+", "-", re.sub(r"[^\w\s-]", "", heading.strip().lower()))


@pytest.mark.parametrize("page", [*TOP, *DOCS], ids=name_of)
def test_links_lead_somewhere(root: Path, page: Path) -> None:
    for link in re.findall(r"\]\(([^)\s]+)\)", re.sub(r"```.*?```", "", page.read_text(), flags=re.S)):
        if link.startswith(("http://", "https://")):
            continue
        target, _, anchor = link.partition("#")
        found = (page.parent / target).resolve() if target else page
        assert found.exists(), link
        if page in DOCS:
            assert found.is_relative_to(root / "docs"), f"{link}: the site holds nothing from outside docs/"
        if anchor:
            assert anchor in map(slug, re.findall(r"^#+ (.*)$", found.read_text(), re.M)), link


@pytest.mark.parametrize("page", [*TOP, *DOCS], ids=name_of)
def test_files_that_pages_name_exist(root: Path, page: Path) -> None:
    """Paths of the repository in code style, such as `mrhubo/body/anatomy.py`; what a run makes is not in it."""
    named = re.findall(r"`((?:mrhubo|conf|data|docs|examples|tests|benchmarks|notebooks)/[\w./-]+)`", page.read_text())
    made = ("data/pairs", "data/external", "conf/my.", "conf/my-")
    missing = [name for name in named if not name.startswith(made) and not (root / name).exists()]
    assert not missing


def test_every_page_of_the_docs_is_in_the_sites_navigation(root: Path) -> None:
    navigation = (root / "mkdocs.yml").read_text().split("\nnav:", 1)[1]
    assert sorted(re.findall(r"[\w/-]+\.md", navigation)) == [str(page.relative_to(root / "docs")) for page in DOCS]


def test_the_start_page_leads_to_every_page_and_every_picture_is_shown(root: Path) -> None:
    start = (root / "docs" / "index.md").read_text()
    pages = {str(page.relative_to(root / "docs")) for page in DOCS if page.parent.name == "docs"} - {"index.md"}
    assert pages <= set(re.findall(r"\]\(([\w/-]+\.md)", start))
    text = "".join(page.read_text() for page in [*TOP, *DOCS])
    assert not [path.name for path in (root / "docs" / "images").iterdir() if f"images/{path.name}" not in text]
