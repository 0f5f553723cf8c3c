"""No password is left in what is stored, logged or printed."""

from __future__ import annotations

import string
from urllib.parse import quote

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrhubo.config import SweepConfig, load_config, to_yaml
from mrhubo.config.secrets import HIDDEN, credentials, has_hidden, redacted, without_secrets


@pytest.mark.parametrize(
    ("address", "shown"),
    [
        ("http://anna:s3cret@host:5000/x", "http://anna:***@host:5000/x"),
        ("http://anna:p@ss@host", "http://anna:***@host"),
        ("http://anna:p/w@ss@host", "http://anna:***@host"),
        ("mysql+pymysql://r:pw#1@h/db", "mysql+pymysql://r:***@h/db"),
        ("https://glpat-token@host", "https://***@host"),
        ("postgresql://host/db?user=a&password=s3cret&sslkey=/k", "postgresql://host/db?user=a&password=***&sslkey=/k"),
        ("https://host/mlflow?access_token=abc", "https://host/mlflow?access_token=***"),
        ("mssql+pyodbc:///?odbc_connect=DRIVER%3Dx%3BPWD%3Dabcd%3B", "mssql+pyodbc:///?odbc_connect=***"),
        ("open http://anna:s3cret@h/1 and postgresql://b:c@i/2", "open http://anna:***@h/1 and postgresql://b:***@i/2"),
    ],
)
def test_a_password_is_hidden(address: str, shown: str) -> None:
    assert redacted(address) == shown and redacted(shown) == shown
    assert has_hidden(shown) and not has_hidden(address)


@pytest.mark.parametrize(
    "address",
    [
        "http://host:5000", "http://[::1]:5000/a@b", "http://host/a@b", "sqlite:////tmp/a@b/m.db", "postgresql://anna@h/db",
        "http://anna:@host", "models:/mrhubo-nao@best", "mail@host", "a: b@c", "",
    ],
)  # fmt: skip
def test_what_holds_none_stays(address: str) -> None:
    assert redacted(address) == address and not has_hidden(address)


@given(st.text(min_size=4), st.sampled_from(["http", "postgresql+psycopg2", "mysql"]))
def test_no_password_is_left_however_it_is_quoted(password: str, scheme: str) -> None:
    """In the address, and where an error quotes a part of it."""
    address = f"{scheme}://user-of-it:{quote(password.encode('utf-8', 'ignore'), safe='')}@the-host:5000/db"
    spelt = quote(password.encode("utf-8", "ignore"), safe="")
    text = redacted(f"cannot open {address}: port '{spelt}' is none", address)
    if len(spelt) > 3 and spelt not in "cannot open ://user-of-it:@the-host:5000/db: port '' is none":
        assert spelt not in text
    assert text.startswith(f"cannot open {scheme}://user-of-it:{HIDDEN}@the-host:5000/db") or not spelt


@given(st.text(string.printable, min_size=1), st.text(string.ascii_letters, min_size=1))
def test_credentials_come_back(password: str, user: str) -> None:
    address = f"http://{user}:{quote(password, safe='')}@host:5000/path"
    assert credentials(address) == ("http://host:5000/path", user, password)
    assert credentials("http://host") == ("http://host", "", "")


def test_configs_are_written_without(root) -> None:
    config = load_config(root / "conf" / "nao.yaml", ["tracking.uri=http://anna:s3cret@host:5000"])
    assert "s3cret" not in to_yaml(without_secrets(config)) and HIDDEN in to_yaml(without_secrets(config))
    assert config.tracking.uri == "http://anna:s3cret@host:5000", "the original is used"
    sweep = SweepConfig("a", {}, storage="postgresql://anna:s3cret@host/db")
    assert "s3cret" not in to_yaml(without_secrets(sweep))
