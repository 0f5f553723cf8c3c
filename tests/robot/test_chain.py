"""pytorch-kinematics without matplotlib, which stays what it is for everybody else."""

from __future__ import annotations

import subprocess
import sys

XML = b"<robot name='r'><link name='a'/><joint name='j' type='revolute'><parent link='a'/><child link='b'/>\
<axis xyz='0 0 1'/><limit lower='-1' upper='1' effort='1' velocity='1'/></joint><link name='b'/></robot>"

CODE = f"""
import sys
{{first}}
from mrhubo.robot.chain import build_chain
assert build_chain({XML!r}).get_joint_parameter_names() == ["j"]
assert ("matplotlib" in sys.modules) == {{loaded}}, [name for name in sys.modules if "matplotlib" in name]
from matplotlib import cm, pyplot
assert pyplot.figure and cm.ScalarMappable
build_chain({XML!r})
assert sys.modules["matplotlib.pyplot"] is pyplot
"""


def test_matplotlib_is_neither_loaded_nor_replaced() -> None:
    for first in ("", "import matplotlib.pyplot"):
        code = CODE.format(first=first, loaded=bool(first))
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
