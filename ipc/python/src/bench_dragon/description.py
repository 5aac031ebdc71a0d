"""Configuration of a run, as the server published it."""

import tomllib
from dataclasses import dataclass
from functools import cached_property
from typing import Any


@dataclass(frozen=True)
class Description:
    """Configuration of a run: the dragons, their routes and the server's settings."""

    run_id: int
    """Run of the configuration."""
    toml: str
    """The complete configuration as TOML."""

    @cached_property
    def config(self) -> dict[str, Any]:
        """The configuration by table and key, such as `config["dragon"]["benches"]`; units are in the keys' names."""
        return tomllib.loads(self.toml)

    @property
    def dragon_names(self) -> tuple[str, ...]:
        """The names of `[[dragons]]`, in their order; empty for a show of one dragon without them."""
        return tuple(dragon["name"] for dragon in self.config.get("dragons", ()))
