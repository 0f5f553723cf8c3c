"""What files call things: names with words of a body model, an estimator or a world in them, and the usual ones.

`smplx_body_pose`, `pred_body_pose` and `body_pose_aa` are what others call `body_pose`; of `global_orient_world` and
`global_orient_cam` the first is in the world, the second as a camera sees it.
"""

from __future__ import annotations

import re

from mrhubo.files.tree import Tree

_WORLD, _CAMERA = ("global", "world"), ("incam", "cam", "camera")
"""Words in the names of parameters in the world, which are preferred, and of those that a camera sees."""
_FREE = {
    "smpl", "smplx", "smplh", "pred", "predicted", "est", "estimated", "opt", "aa", "axis", "angle", "angles", "rotmat",
    "world", "incam", "cam", "camera",
}  # fmt: skip
"""Words without which a name is the usual one: of models, estimators, forms of rotations, and worlds."""
_MODEL = re.compile(r"smpl[xh](?![a-z])")
_NESTED = re.compile(r"([A-Za-z][\w-]*)[./]([A-Za-z][\w./-]*)")
_MOST = 200
"""Entries of a dictionary that has names, and not those of people or frames."""


def words_of(name: str) -> list[str]:
    """The words of a name in small letters: of `smpl_params-incam` and `smplParamsIncam` the same."""
    return re.findall(r"[^\W_]+", re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).lower())


def without_world(name: str) -> str:
    """A name without the words that tell whether its parameters are in the world or as a camera sees them."""
    return "_".join(word for word in words_of(name) if word not in (*_WORLD, *_CAMERA))


def rank(name: str) -> int:
    """How early a dictionary of parameters is looked into, by its name: first those in the world, last a camera's."""
    words = words_of(name)
    if any(word in words for word in _WORLD):
        return 0
    return 2 if any(word in words for word in _CAMERA) else 1


def model_named(where: str) -> str:
    """The body model that a name has in it: `smplx`, `smplh`; none of `smpl`, as those of all models are called."""
    found = _MODEL.search(where.lower())
    return "" if found is None else found[0]


def usual_name(name: str) -> str:
    """A name without words that others leave out: of `smplx_body_pose` and `body_pose_world` it is `body_pose`."""
    return "_".join(word for word in words_of(name) if word not in _FREE)


def by_usual_names(node: Tree) -> Tree:
    """The entries of a dictionary that have unusual names, by the usual ones; of several of one name that in the world,
    else that which no word says to be a camera's, else the first.
    """
    return node.renamed(_unusual(node, (0, 1, 2)))


def in_world(node: Tree) -> Tree:
    """The entries of a dictionary whose names say that they are in the world, by the usual names."""
    return node.renamed(_unusual(node, (0,)))


def _unusual(node: Tree, ranks: tuple[int, ...]) -> dict[str, str]:
    keys = node.keys
    found: dict[str, str] = {}
    if len(keys) <= _MOST:
        for key in sorted(keys, key=_seen_from):
            usual = usual_name(key)
            if usual and usual != key and _seen_from(key) in ranks:
                found.setdefault(usual, key)
    return found


def _seen_from(key: str) -> int:
    """0 of what is in the world, 2 of what a camera sees, 1 of what does not say; `global` is said of roots too."""
    words = words_of(key)
    if "world" in words:
        return 0
    return 2 if any(word in words for word in _CAMERA) else 1


def nested(node: Tree) -> Tree:
    """A dictionary whose names have other dictionaries' names before a point or a slash, as in
    `body_params_global.transl`, with those in it; any other as it is.
    """
    keys = node.keys if node.is_mapping else ()
    parts = {key: match for key in keys if (match := _NESTED.fullmatch(key)) is not None}
    outer = {match[1] for match in parts.values()}
    if not parts or len(keys) > _MOST or outer & set(keys):
        return node
    own = {key: key for key in keys if key not in parts}
    inner = {name: {match[2]: key for key, match in parts.items() if match[1] == name} for name in sorted(outer)}
    return node.renamed(own, inner)
