"""Settings: YAML plus ``key.sub=value`` -> typed dataclasses; every mistake is one sentence."""

from mrhubo.config.command import parse_arguments, run_command, split_arguments
from mrhubo.config.help import field_docs, help_text
from mrhubo.config.kinds import keys_of
from mrhubo.config.loading import load_config
from mrhubo.config.plain import changed_settings, fingerprint, to_plain, to_yaml, without_paths
from mrhubo.config.schema import (
    BaselineConfig,
    BodyConfig,
    Config,
    EvaluationConfig,
    ManualScaleConfig,
    ModelConfig,
    PairsConfig,
    RobotConfig,
    S3LEConfig,
    ScaleSearchConfig,
    TrackingConfig,
    TrainerConfig,
    bounded,
    choice,
)
from mrhubo.config.sweeps import SweepConfig

__all__ = [
    "BaselineConfig",
    "BodyConfig",
    "Config",
    "EvaluationConfig",
    "ManualScaleConfig",
    "ModelConfig",
    "PairsConfig",
    "RobotConfig",
    "S3LEConfig",
    "ScaleSearchConfig",
    "SweepConfig",
    "TrackingConfig",
    "TrainerConfig",
    "bounded",
    "changed_settings",
    "choice",
    "field_docs",
    "fingerprint",
    "help_text",
    "keys_of",
    "load_config",
    "parse_arguments",
    "split_arguments",
    "run_command",
    "to_plain",
    "to_yaml",
    "without_paths",
]
