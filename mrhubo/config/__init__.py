"""Settings: YAML plus ``key.sub=value`` -> typed dataclasses; every mistake is one sentence."""

from mrhubo.config.arguments import CommandParser, nonempty, number, parse_arguments, whole_number
from mrhubo.config.baseline import BaselineConfig, S3LEConfig
from mrhubo.config.command import print_error, run_command
from mrhubo.config.entries import (
    ConstantEntry,
    FrameEntry,
    HandEntry,
    KeypointEntry,
    ManualEntry,
    MeanEntry,
    PointEntry,
    Range,
    Vector,
)
from mrhubo.config.fields import bounded, choice
from mrhubo.config.help import field_docs
from mrhubo.config.kinds import keys_of
from mrhubo.config.live import LiveConfig
from mrhubo.config.loading import load_config
from mrhubo.config.places import places_named, where, with_places
from mrhubo.config.plain import changed_settings, fingerprint, flow_yaml, to_plain, to_yaml, without_paths
from mrhubo.config.prior import SHIPPED_PRIOR, PriorConfig
from mrhubo.config.schema import (
    BodyConfig,
    Config,
    EvaluationConfig,
    ManualScaleConfig,
    ModelConfig,
    PairsConfig,
    RobotConfig,
    ScaleSearchConfig,
    TrackingConfig,
    TrainerConfig,
)
from mrhubo.config.shipped import find_config, is_config, shipped_root
from mrhubo.config.sweeps import SpaceEntry, SpaceRange, SweepConfig
from mrhubo.config.tuning import usual_trainer
from mrhubo.config.typed import typed_value
from mrhubo.config.universal import SHIPPED_UNIVERSAL, UniversalConfig

__all__ = [
    "SHIPPED_PRIOR",
    "SHIPPED_UNIVERSAL",
    "BaselineConfig",
    "BodyConfig",
    "CommandParser",
    "Config",
    "ConstantEntry",
    "EvaluationConfig",
    "FrameEntry",
    "HandEntry",
    "KeypointEntry",
    "LiveConfig",
    "ManualEntry",
    "ManualScaleConfig",
    "MeanEntry",
    "ModelConfig",
    "PairsConfig",
    "PointEntry",
    "PriorConfig",
    "Range",
    "RobotConfig",
    "S3LEConfig",
    "ScaleSearchConfig",
    "SpaceEntry",
    "SpaceRange",
    "SweepConfig",
    "TrackingConfig",
    "TrainerConfig",
    "UniversalConfig",
    "Vector",
    "bounded",
    "changed_settings",
    "choice",
    "field_docs",
    "find_config",
    "is_config",
    "fingerprint",
    "flow_yaml",
    "keys_of",
    "load_config",
    "number",
    "parse_arguments",
    "places_named",
    "print_error",
    "run_command",
    "shipped_root",
    "nonempty",
    "to_plain",
    "to_yaml",
    "typed_value",
    "usual_trainer",
    "where",
    "whole_number",
    "with_places",
    "without_paths",
]
