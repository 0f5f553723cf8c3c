"""Where a session listens and sends: addresses as users write them, and who may be listened to.

Loopback needs no token: whoever can send there is on this machine. Anything else does.
"""

from __future__ import annotations

import contextlib
import ipaddress
import os
import secrets
import socket
from dataclasses import dataclass

from mrhubo.errors import UserError, shortened

LOOPBACK = "127.0.0.1"
TOKEN_VARIABLE = "MRHUBO_LIVE_TOKEN"
_SHORTEST_TOKEN = 16


Address = ipaddress.IPv4Address | ipaddress.IPv6Address


def read_address(text: str) -> Address | None:
    """An IP address; None where it is a name, or nothing."""
    with contextlib.suppress(ValueError):
        return ipaddress.ip_address(text)
    return None


def own_addresses() -> set[Address]:
    """This machine's, but for those that change with every start of a network."""
    import psutil

    told = [entry.address for entries in psutil.net_if_addrs().values() for entry in entries]
    return {found for text in told if (found := read_address(text)) is not None and is_lasting(found)}


def is_lasting(address: Address) -> bool:
    """Whether somebody may be found by an address more than once."""
    return not (address.is_link_local or address.is_unspecified)


@dataclass(frozen=True)
class Endpoint:
    """A host and a port."""

    host: str
    port: int

    @classmethod
    def read(cls, text: str, what: str, default_port: int | None = None, host: str = LOOPBACK) -> Endpoint:
        """Of `HOST:PORT`, `[IPv6]:PORT`, `PORT`, or nothing.

        Args:
            text: what a user wrote.
            what: the flag, for sentences.
            default_port: where none is written.
            host: where none is written.

        Raises:
            UserError: there is no port, or it is none.
        """
        name, colon, port = text.rpartition(":")
        if not text:
            port = "" if default_port is None else str(default_port)
        if colon:
            host = name.removeprefix("[").removesuffix("]")
        if not port.isascii() or not port.isdigit() or len(port) > 5 or int(port) > 65_535 or not host:
            raise UserError(f"{what}: '{shortened(text)}' is no HOST:PORT, for instance 127.0.0.1:9000")
        return cls(host, int(port))

    @property
    def shown(self) -> str:
        """As it is written in a URL."""
        return f"[{self.host}]:{self.port}" if ":" in self.host else f"{self.host}:{self.port}"

    @property
    def is_loopback(self) -> bool:
        """Whether only this machine reaches it."""
        return is_loopback(self.host)

    def destination(self) -> tuple[socket.socket, tuple]:
        """A socket that may send datagrams to the address, and the address.

        Raises:
            UserError: the host has no address, or is a whole network (broadcast), to which the system sends nothing.
        """
        unbound, address = self.socket()
        try:
            with socket.socket(unbound.family, socket.SOCK_DGRAM) as probe:
                probe.connect(address)  # sends nothing
        except PermissionError as error:
            unbound.close()
            raise UserError(f"{self.shown}: cannot be sent to: it is a broadcast address; name one receiver") from error
        except OSError:  # a network that is not there now may be later
            pass
        return unbound, address

    def reaches(self, other: Endpoint) -> bool:
        """Whether a datagram that is sent here comes to a socket that is bound to another endpoint.

        Raises:
            UserError: one of the hosts has no address.
        """
        if self.port != other.port or self.port == 0:
            return False
        to, at = self._address(), other._address()
        if to.is_unspecified:  # the system takes it for this machine's own loopback
            to = ipaddress.ip_address("::1" if to.version == 6 else LOOPBACK)
        return _is_ours(to) if at.is_unspecified else to == at

    def _address(self) -> ipaddress.IPv4Address | ipaddress.IPv6Address:
        unbound, address = self.socket()
        unbound.close()
        found = ipaddress.ip_address(address[0].split("%")[0])
        mapped = found.ipv4_mapped if isinstance(found, ipaddress.IPv6Address) else None
        return mapped or found

    def bound(self, kind: int = socket.SOCK_DGRAM) -> socket.socket:
        """A socket that is bound to the address.

        Raises:
            UserError: the address is used, or not ours.
        """
        bound, address = self.socket(kind)
        try:
            if kind == socket.SOCK_STREAM and os.name == "posix":  # as asyncio does: a port that was just left is free
                bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            bound.bind(address)
        except OSError as error:
            bound.close()
            raise UserError(f"{self.shown}: cannot listen there: {error.strerror or error}") from error
        return bound

    def socket(self, kind: int = socket.SOCK_DGRAM) -> tuple[socket.socket, tuple]:
        """A socket of the right family that is not bound yet, and the address.

        Raises:
            UserError: the host has no address.
        """
        try:
            family, kind, protocol, _, address = socket.getaddrinfo(self.host, self.port, type=kind)[0]
            return socket.socket(family, kind, protocol), address
        except (OSError, UnicodeError) as error:
            raise UserError(f"{self.shown}: cannot be used: {getattr(error, 'strerror', None) or error}") from error


def _is_ours(address: ipaddress.IPv4Address | ipaddress.IPv6Address) -> bool:
    """Whether an address is one of this machine's."""
    try:
        with socket.socket(socket.AF_INET if address.version == 4 else socket.AF_INET6, socket.SOCK_DGRAM) as probe:
            probe.bind((str(address), 0))
    except OSError:
        return False
    return True


def is_loopback(host: str) -> bool:
    """Whether a host is this machine alone."""
    try:
        return ipaddress.ip_address(host.split("%")[0]).is_loopback
    except ValueError:
        return host == "localhost"


def find_token(host: str) -> str | None:
    """The token that messages need which come to a host: None on loopback, else that of the environment variable
    MRHUBO_LIVE_TOKEN, or a random one.

    Raises:
        UserError: the variable's is too short to be a secret.
    """
    if is_loopback(host):
        return None
    given = os.environ.get(TOKEN_VARIABLE)
    if given is None:
        return secrets.token_urlsafe(24)
    if len(given) < _SHORTEST_TOKEN or not given.isascii() or not given.isprintable() or " " in given:
        raise UserError(f"{TOKEN_VARIABLE}: must be {_SHORTEST_TOKEN} letters and digits or more, without spaces")
    return given


def token_fits(expected: str | None, given: object) -> bool:
    """Whether a sender may be listened to; takes as long for a wrong token as for a nearly right one."""
    if expected is None:
        return True
    return isinstance(given, str) and secrets.compare_digest(expected.encode(), given.encode("utf-8", "replace"))
