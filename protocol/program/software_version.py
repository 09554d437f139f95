"""The version of the software, for the files that it writes."""

from importlib.metadata import PackageNotFoundError, version


def software_version() -> str:
    """Return the installed version; "unknown" in a checkout that was not installed."""
    try:
        return version("seventh-axis")
    except PackageNotFoundError:
        return "unknown"
