"""Robot poses turned into human poses: latent inverse kinematics, Algorithm 1, shards on disk, the filter."""

from mrhubo.pairing.filter import PairFilter, make_filter
from mrhubo.pairing.generate import PairGenerator
from mrhubo.pairing.lbfgs import solve_lbfgs
from mrhubo.pairing.scale_objective import ScaleFactorObjective
from mrhubo.pairing.setup import PairSetup
from mrhubo.pairing.store import PairStore, pose_settings
from mrhubo.pairing.workers import PairingReport, generate_pairs

__all__ = [
    "PairFilter",
    "PairGenerator",
    "PairSetup",
    "PairStore",
    "PairingReport",
    "ScaleFactorObjective",
    "generate_pairs",
    "make_filter",
    "pose_settings",
    "solve_lbfgs",
]
