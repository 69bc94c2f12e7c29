"""Actions: what changes the scene while it runs, each on a trigger."""

from barchan.actions.outlet import Outlet

__all__ = ["Outlet"]
