"""`--bvh-map FILE.yaml`: what the user says of a tree of joints.

    left_shoulder: LeftArm   # our joint: the file's
    up: z                    # the axis that is up: x, y, z, -x, -y or -z
    unit: 0.01               # metres

Whatever is not said is found out.
"""

from __future__ import annotations

from pathlib import Path

import yaml

from mrhubo.errors import UserError, shortened, unknown_name
from mrhubo.files.regular import read_regular
from mrhubo.motion.readers.tree.anatomy import ROLES
from mrhubo.motion.readers.tree.convert import Given
from mrhubo.motion.readers.tree.hierarchy import JointTree

_MAX_BYTES = 100_000
_UP = tuple(sign + axis for axis in "xyz" for sign in ("", "-"))


def read_map(path: Path, tree: JointTree, motion: Path) -> Given:
    """Reads a map and looks its joints up.

    Args:
        path: of the map.
        tree: the joints.
        motion: the file with the tree, for sentences.

    Raises:
        UserError: it is no map, or names what there is not.
    """
    path = Path(path)
    try:
        content = yaml.safe_load(read_regular(path, _MAX_BYTES))
    except (yaml.YAMLError, UnicodeDecodeError, RecursionError, ValueError) as error:
        raise UserError(f"{path}: is no YAML: {shortened(' '.join(str(error).split()), 120)}") from error
    if not isinstance(content, dict):
        raise UserError(f"{path}: expected lines such as 'left_shoulder: LeftArm'")
    place: dict[str, int] = {}
    for key, value in content.items():
        if key in ("up", "unit"):
            continue
        if key not in ROLES:
            raise UserError(f"{path}: {unknown_name('joint of ours', str(key), (*ROLES, 'up', 'unit'))}")
        found = [i for i, name in enumerate(tree.names) if name == str(value)]
        if not found:
            raise UserError(f"{path}: {key}: {unknown_name('joint', str(value), tree.names, motion.name)}")
        if len(found) > 1:
            raise UserError(f"{path}: {key}: {motion.name} has {len(found)} joints of the name '{value}'")
        place[key] = found[0]
    for key, value in place.items():
        twin = next((other for other in place if other != key and place[other] == value), None)
        if twin is not None and {key, twin} != {"pelvis", "spine3"} and {key, twin} != {"neck", "head"}:
            raise UserError(f"{path}: {key} and {twin} are both '{tree.names[value]}'")
    up = content.get("up")
    if up is not None and up not in _UP:
        raise UserError(f"{path}: up: expected one of {', '.join(_UP)}, found {shortened(up, 30)}")
    unit = content.get("unit")
    if unit is not None and not (type(unit) in (int, float) and 1e-6 <= unit <= 1e3):
        raise UserError(f"{path}: unit: expected metres, for instance 0.01, found {shortened(unit, 30)}")
    return Given(place, up, None if unit is None else float(unit))
