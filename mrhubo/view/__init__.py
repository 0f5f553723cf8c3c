"""Pictures: figures made of capsules, a renderer without OpenGL, tables of pictures, charts."""

from mrhubo.view.camera import Camera, common_cameras
from mrhubo.view.distributions import distributions
from mrhubo.view.figures import animated_frames, figure_animation, figure_sheet, human_figure
from mrhubo.view.human import HUMAN_COLOR, SKIN_COLOR, human_solids
from mrhubo.view.painter import render
from mrhubo.view.robot import robot_solids, stick_radius, stick_solids
from mrhubo.view.sheets import contact_sheet, phi_histogram, save_gif, save_png
from mrhubo.view.solids import Solids

__all__ = [
    "HUMAN_COLOR",
    "SKIN_COLOR",
    "Camera",
    "Solids",
    "animated_frames",
    "common_cameras",
    "contact_sheet",
    "distributions",
    "figure_animation",
    "figure_sheet",
    "human_figure",
    "human_solids",
    "phi_histogram",
    "render",
    "robot_solids",
    "save_gif",
    "save_png",
    "stick_radius",
    "stick_solids",
]
