"""The certificate of a live page that is served by https: one that we make for this machine, or a user's own.

Ours is signed by its own key, so a browser warns of it. It is kept in the user's cache, so that what a browser's user
decides holds, and made anew only where this machine got another address or name, or before it runs out.
"""

from __future__ import annotations

import contextlib
import datetime
import os
import socket
import ssl
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from mrhubo.errors import UserError
from mrhubo.files.atomic import atomic_path
from mrhubo.files.cache import user_cache
from mrhubo.files.regular import read_regular
from mrhubo.lazy import import_optional
from mrhubo.live.endpoints import is_lasting, own_addresses, read_address

if TYPE_CHECKING:
    from cryptography.x509 import Certificate, GeneralName

_DAYS, _LEFT_DAYS = 365, 30
"""How long ours is valid, and how long before its end it is made anew."""
_MOST_BYTES = 2**20


@dataclass(frozen=True)
class ServerCertificate:
    """What a server needs to be one of https."""

    context: ssl.SSLContext
    fingerprint: str
    """SHA-256 of the certificate, as browsers show it: 32 pairs of hex digits."""
    path: Path
    ours: bool


def open_certificate(own: Path | None = None, host: str = "") -> ServerCertificate:
    """The user's own certificate, or one for this machine.

    Args:
        own: a PEM file of a certificate, of those that vouch for it, and of its key; None: ours.
        host: another name or address of this machine by which it is visited.

    Raises:
        UserError: the file cannot be read or is none; the cache cannot be written; cryptography is not installed.
    """
    import_optional("cryptography.x509", "--https needs cryptography: pip install 'mrhubo[live]'")
    path = own if own is not None else _our_file(host)
    try:
        text = read_regular(path, _MOST_BYTES)
        context = ssl.create_default_context(ssl.Purpose.CLIENT_AUTH)
        context.load_cert_chain(path, password=_refuse)
    except ssl.SSLError as error:
        raise UserError(f"{path}: is no certificate followed by its key, PEM, without a password: {error}") from error
    from cryptography import x509
    from cryptography.hazmat.primitives.hashes import SHA256

    digest = x509.load_pem_x509_certificate(text).fingerprint(SHA256())
    return ServerCertificate(context, digest.hex(":").upper(), path, own is None)


def _refuse() -> str:
    raise UserError("the key of the certificate has a password; give a file without one")


def _our_file(host: str) -> Path:
    """The file of our certificate and key, which is made where there is none that still serves."""
    path, names = user_cache() / "live" / "certificate.pem", _our_names(host)
    if not _serves(path, names):
        content = _make(names)
        with (
            atomic_path(path) as temporary,
            os.fdopen(os.open(temporary, os.O_WRONLY | os.O_CREAT, 0o600), "wb") as file,
        ):
            file.write(content)
    return path


def _serves(path: Path, names: list[GeneralName]) -> bool:
    """Whether a file has a certificate of ours for all of some names that is valid for some time."""
    from cryptography import x509

    with contextlib.suppress(UserError, ValueError, x509.ExtensionNotFound):
        found = x509.load_pem_x509_certificate(read_regular(path, _MOST_BYTES))
        until = found.not_valid_after_utc - datetime.timedelta(days=_LEFT_DAYS)
        told = found.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
        return _now() < until and found.not_valid_before_utc <= _now() and set(names) <= set(told)
    return False


def _our_names(host: str) -> list[GeneralName]:
    """Names and addresses by which this machine may be visited."""
    from cryptography import x509

    own = socket.gethostname().lower()
    names = ["localhost", own, f"{own}.local", *([] if read_address(host) or not host else [host.lower()])]
    more = {address for text in ("127.0.0.1", "::1", host) if (address := read_address(text)) is not None}
    # Names that a certificate cannot hold, and what changes with every start of a network, are left out.
    usable = [name for name in dict.fromkeys(names) if name.isascii() and " " not in name]
    addresses = sorted(own_addresses() | set(filter(is_lasting, more)), key=str)
    return [*map(x509.DNSName, usable), *map(x509.IPAddress, addresses)]


def _now() -> datetime.datetime:
    return datetime.datetime.now(datetime.UTC)


def _make(names: list[GeneralName]) -> bytes:
    """A certificate and its key, PEM: ECDSA on P-256, for servers alone, and none that vouches for others."""
    from cryptography import x509
    from cryptography.hazmat.primitives import hashes, serialization
    from cryptography.hazmat.primitives.asymmetric import ec
    from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

    key = ec.generate_private_key(ec.SECP256R1())
    subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "mrhubo live")])
    usage = dict.fromkeys(
        ("content_commitment", "key_encipherment", "data_encipherment", "key_agreement", "key_cert_sign", "crl_sign",
         "encipher_only", "decipher_only"), False,
    )  # fmt: skip
    certificate: Certificate = (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(subject)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(_now() - datetime.timedelta(days=1))  # a phone's clock may be behind
        .not_valid_after(_now() + datetime.timedelta(days=_DAYS))
        .add_extension(x509.SubjectAlternativeName(names), critical=False)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(x509.KeyUsage(digital_signature=True, **usage), critical=True)
        .add_extension(x509.ExtendedKeyUsage([ExtendedKeyUsageOID.SERVER_AUTH]), critical=False)
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(key.public_key()), critical=False)
        .sign(key, hashes.SHA256())
    )
    secret = key.private_bytes(
        serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
    )
    return certificate.public_bytes(serialization.Encoding.PEM) + secret
