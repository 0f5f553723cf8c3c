"""A robot with two arms that nothing is wrong with: tests change one place of it (`pair` in conftest.py)."""

from __future__ import annotations


def _pair() -> str:
    """One element a line. Above the chest a fixed base, a neck that no test of the body needs, hands at fixed wrists."""
    links = [
        "base",
        "chest",
        "head",
        *(f"{s}_{n}" for s in "lr" for n in ("shoulder", "upper", "fore", "lower", "hand")),
    ]

    def joint(name: str, parent: str, child: str, xyz: str, axis: str = "", limit: str = "") -> str:
        lines = [f'<joint name="{name}" type="{"revolute" if axis else "fixed"}">', f'<origin xyz="{xyz}"/>',
                 f'<parent link="{parent}"/>', f'<child link="{child}"/>']  # fmt: skip
        lines += [f'<axis xyz="{axis}"/>', f'<limit {limit} effort="1" velocity="1"/>'] if axis else []
        return "\n".join([*lines, "</joint>"])

    joints = [joint("waist", "base", "chest", "0 0 0.5"),
              joint("neck", "chest", "head", "0 0 0.4", "0 0 1", 'lower="-1.5" upper="1.5"')]  # fmt: skip
    for s, y, roll in (("l", 0.2, 'lower="-0.2" upper="2.8"'), ("r", -0.2, 'lower="-2.8" upper="0.2"')):
        joints += [
            joint(f"{s}_pitch", "chest", f"{s}_shoulder", f"0 {y} 0.3", "0 1 0", 'lower="-3" upper="1.2"'),
            joint(f"{s}_roll", f"{s}_shoulder", f"{s}_upper", "0 0 0", "1 0 0", roll),
            joint(f"{s}_yaw", f"{s}_upper", f"{s}_fore", "0 0 -0.25", "0 0 1", 'lower="-1.5" upper="1.5"'),
            joint(f"{s}_elbow", f"{s}_fore", f"{s}_lower", "0 0 0", "0 1 0", 'lower="-2.3" upper="0"'),
            joint(f"{s}_wrist", f"{s}_lower", f"{s}_hand", "0 0 -0.22"),
        ]
    body = "\n".join([*(f'<link name="{link}"/>' for link in links), *joints])
    return f'<robot name="pair">\n{body}\n</robot>\n'


PAIR = _pair()
KEYPOINTS = {
    "chest": "chest",
    **{f"{side}_{point}": f"{side[0]}_{link}" for side in ("left", "right")
       for point, link in (("shoulder", "upper"), ("elbow", "lower"), ("wrist", "hand"))},
}  # fmt: skip


def line_of(text: str) -> int:
    """The line of PAIR that a text stands in."""
    return PAIR[: PAIR.index(text)].count("\n") + 1


def joint_of(name: str) -> str:
    """The element of one joint of PAIR."""
    start = PAIR.index(f'<joint name="{name}"')
    return PAIR[start : PAIR.index("</joint>", start) + len("</joint>")]
