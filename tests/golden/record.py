"""`python -m tests.golden.record`, from the repository's root: writes down this platform's golden values."""

from __future__ import annotations

import tempfile
from pathlib import Path

from tests.golden.values import measure, platform_key, write_values

if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        print(write_values(platform_key(), measure(Path(folder))))
