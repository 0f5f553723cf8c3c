"""What sources and sinks there are, as `--help` tells them."""

from __future__ import annotations

SOURCES = {
    "ws": "ws[:PORT]: JSON messages by WebSocket, with a page for the browser (port 8765)",
    "udp": "udp[:PORT]: JSON messages in UDP datagrams (port 8766)",
    "vmc": "vmc[:PORT]: an avatar's bones by the VMC protocol, from this machine (port 39539)",
    "xsens": "xsens[:PORT]: a body of Xsens MVN's Network Streamer, from this machine (port 9763)",
    "pico": "pico: body tracking of a PICO headset by XRoboToolkit",
    "camera": "camera[:DEVICE][@MODEL]: a person before a camera of this machine (0; model lite, full or heavy)",
    "video": "video:FILE[@MODEL]: a person in a film, as if a camera saw it now",
    "replay": "replay:FILE[@RATE]: a motion file at its rate, or at RATE where it tells none;"
    " replay-loop:FILE[@RATE]: again and again",
}
"""By name, what comes from where."""
SINKS = {
    "ws": "ws[:PORT]: JSON messages by WebSocket, with the page (port 8765)",
    "udp": "udp:HOST:PORT: JSON messages in UDP datagrams",
    "file": "file:PATH: a file as mrhubo retarget writes it, of the whole session",
    "mcap": "mcap:PATH: a ROS 2 bag that grows, a JointTrajectory for each moment",
    "ros2": "ros2[:TOPIC]: a JointTrajectory for each moment (/joint_trajectory)",
    "mujoco": "mujoco[:MODEL]: the robot in simulation, its base fixed; mujoco-free[:MODEL]: free, on a floor",
}
"""By name, what goes where."""
