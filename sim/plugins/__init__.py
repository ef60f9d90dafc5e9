"""What other packages bring: found by entry points, loaded when it is named."""

from gaitswarm.sim.plugins.entry_points import GROUPS, Kind, Plugin, PluginError, find_plugins
from gaitswarm.sim.plugins.registry import KnownName, Registry, check_is, check_name
from gaitswarm.sim.plugins.settings import PluginSettings
from gaitswarm.sim.plugins.versions import MISSING, plugin_versions, source_digest, version_of

__all__ = [
    "GROUPS",
    "MISSING",
    "Kind",
    "KnownName",
    "Plugin",
    "PluginError",
    "PluginSettings",
    "Registry",
    "check_is",
    "check_name",
    "find_plugins",
    "plugin_versions",
    "source_digest",
    "version_of",
]
