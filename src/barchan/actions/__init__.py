"""Actions: what changes the scene while it runs, each on a trigger; and what they do, as functions."""

from barchan.actions.change import Change
from barchan.actions.inlet import Feed, Inlet
from barchan.actions.mark import mark_places
from barchan.actions.outlet import Outlet
from barchan.actions.remove import Removed, remove_where

__all__ = ["Change", "Feed", "Inlet", "Outlet", "Removed", "mark_places", "remove_where"]
