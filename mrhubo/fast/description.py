"""A trained retargeter as plain arrays: all that an answer needs, and nothing that has to be worked out first.

`mrhubo.retargeter.describing` makes it of a retargeter, and a package holds it as `runtime.safetensors`. A robot's
computer needs that one file, NumPy, and no PyTorch.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from mrhubo.errors import UserError, shortened
from mrhubo.fast.checks import check
from mrhubo.fast.leg_section import Legs, RootTurn
from mrhubo.fast.sections import (
    SECTIONS,
    Capsules,
    Cost,
    Features,
    Human,
    Kinematics,
    Layers,
    Part,
    Prior,
    Reading,
    Settings,
    Trust,
    Universal,
)
from mrhubo.files.arrays import read_arrays
from mrhubo.files.atomic import checksum_file

SCHEMA = "mrhubo.runtime/1"
FILE = "runtime.safetensors"
"""Its name in a package."""

WEIGHTS = "retargeter.safetensors"
"""The file of a package whose checksum it knows."""
_RENEW = "where PyTorch is, mrhubo.load(folder).save_description(folder) writes it anew"


@dataclass(frozen=True)
class Description:
    """All of it."""

    human: Human
    features: Features
    pre: tuple[Part, ...]
    """Networks from features to links; none of one stage."""
    post: tuple[Part, ...]
    """Networks to joint angles; where there are none, the nearest of the cost's poses are what answers begin at."""
    kinematics: Kinematics
    cost: Cost
    reading: Reading
    prior: Prior
    trust: Trust
    capsules: Capsules
    settings: Settings
    universal: Universal | None = None
    """In place of `pre` and `post`, which are then none."""
    legs: Legs | None = None
    """Of a robot that stands on feet."""
    root: RootTurn | None = None
    """Of one whose base is not turned as the person's pelvis."""

    @cached_property
    def standing(self) -> Description:
        """The same with the blocks of joints that there are where the places of soles cost too."""
        if self.legs is None:
            return self
        return replace(self, cost=replace(self.cost, block_N=self.legs.block_N, block_D=self.legs.block_D))

    def asked_by(self, target_BX3: np.ndarray) -> Description:
        """`standing` for targets with the places of soles after the directions, else this one."""
        return self.standing if target_BX3.shape[1] > len(self.cost.weight_D) else self

    def arrays(self) -> dict[str, np.ndarray]:
        """Every array, by a name that `Description.of` reads."""
        found: dict[str, np.ndarray] = {}
        for name in SECTIONS:
            section = getattr(self, name)
            found |= {f"{name}.{field.name}": getattr(section, field.name) for field in fields(section)}
        for stage in ("pre", "post"):
            for number, part in enumerate(getattr(self, stage)):
                found |= {f"{stage}.{number}.input": part.input, f"{stage}.{number}.output": part.output}
                found |= _of_layers(f"{stage}.{number}", part.layers)
        for coder in ("encoder", "decoder"):
            found |= _of_layers(f"prior.{coder}", getattr(self.prior, coder))
        found |= {f"{_SPACES}{i}": space for i, space in enumerate(self.prior.spaces or ())}
        if self.universal is not None:
            found |= {f"universal.{name}": getattr(self.universal, name) for name in _UNIVERSAL}
            found |= {f"{_WEIGHTS}{name}": array for name, array in self.universal.weights.items()}
        for name, section in (("legs", self.legs), ("root", self.root)):
            if section is not None:
                found |= {f"{name}.{field.name}": getattr(section, field.name) for field in fields(section)}
        return found

    def metadata(self) -> dict[str, str]:
        """The settings, and what kind of file it is."""
        told = {field.name: getattr(self.settings, field.name) for field in fields(Settings)}
        return {"schema": SCHEMA, "settings": json.dumps(told)}

    @classmethod
    def of(cls, arrays: Mapping[str, np.ndarray], metadata: Mapping[str, str]) -> Description:
        """What `arrays` and `metadata` gave.

        Raises:
            KeyError, ValueError, TypeError: they are others.
        """
        told = json.loads(metadata["settings"])
        names = {name: tuple(told[name]) for name in ("joint_names", "direction_names", "branch_names")}
        sections: dict[str, Any] = {name: _section(kind, name, arrays) for name, kind in SECTIONS.items()}
        stages: dict[str, Any] = {stage: _parts(stage, arrays) for stage in ("pre", "post")}
        encoder, decoder = (_layers(f"prior.{coder}", arrays) for coder in ("encoder", "decoder"))
        spaces = tuple(arrays[f"{_SPACES}{i}"] for i in range(len(encoder))) if f"{_SPACES}0" in arrays else None
        prior = Prior(encoder, decoder, spaces)
        universal = _universal(arrays) if "universal.block_E" in arrays else None
        legs = _section(Legs, "legs", arrays) if "legs.body_H" in arrays else None
        root = _section(RootTurn, "root", arrays) if "root.leg_D" in arrays else None
        settings = Settings(**{**told, **names})
        return cls(prior=prior, settings=settings, universal=universal, legs=legs, root=root, **sections, **stages)

    @classmethod
    def read(cls, path: Path) -> Description:
        """Of a file, or of the package in a folder.

        Raises:
            UserError: it is missing, damaged, of another version, or of another package than it lies in.
        """
        file = path / FILE if path.is_dir() else path
        arrays, metadata = read_arrays(file)
        if metadata.get("schema") != SCHEMA:
            raise UserError(f"{file}: schema is '{shortened(metadata.get('schema'))}', expected '{SCHEMA}'; {_RENEW}")
        try:
            found = cls.of(arrays, metadata)
            check(found)
        except (KeyError, ValueError, TypeError, AttributeError, RecursionError) as error:
            raise UserError(f"{file}: is no description that this version reads: {error}") from error
        weights = file.with_name(WEIGHTS)
        if weights.is_file() and checksum_file(weights) != found.settings.facts["checksum"]:
            raise UserError(f"{file}: belongs to another package than the {WEIGHTS} beside it; {_RENEW}")
        return found


Kind = TypeVar("Kind")
_SPACES, _WEIGHTS = "prior.spaces.", "universal.weights."
_UNIVERSAL = [field.name for field in fields(Universal) if field.name != "weights"]


def _section(kind: type[Kind], name: str, arrays: Mapping[str, np.ndarray]) -> Kind:
    return kind(**{field.name: arrays[f"{name}.{field.name}"] for field in fields(kind)})  # pyright: ignore


def _universal(arrays: Mapping[str, np.ndarray]) -> Universal:
    weights = {name.removeprefix(_WEIGHTS): array for name, array in arrays.items() if name.startswith(_WEIGHTS)}
    return Universal(weights=weights, **{name: arrays[f"universal.{name}"] for name in _UNIVERSAL})


def _of_layers(name: str, layers: Layers) -> dict[str, np.ndarray]:
    pairs = {f"{name}.layers.{i}": pair for i, pair in enumerate(layers)}
    return {
        f"{place}.{kind}": array
        for place, pair in pairs.items()
        for kind, array in zip(("weight", "bias"), pair, strict=True)
    }


def _layers(name: str, arrays: Mapping[str, np.ndarray]) -> Layers:
    found = []
    while f"{name}.layers.{len(found)}.weight" in arrays:
        place = f"{name}.layers.{len(found)}"
        found.append((arrays[f"{place}.weight"], arrays[f"{place}.bias"]))
    return tuple(found)


def _parts(stage: str, arrays: Mapping[str, np.ndarray]) -> tuple[Part, ...]:
    found: list[Part] = []
    while (place := f"{stage}.{len(found)}") + ".input" in arrays:
        found.append(Part(arrays[f"{place}.input"], arrays[f"{place}.output"], _layers(place, arrays)))
    return tuple(found)
