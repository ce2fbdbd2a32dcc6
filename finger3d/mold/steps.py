"""Text of the steps of casting, for the sheet and the page of a mold."""

from __future__ import annotations

from finger3d.mold.parts import Mold, Pour


def prepare_lines(made: Mold) -> list[str]:
    """Return what is done to the open halves."""
    o = made.options
    lines = ["Spray every face that silicone touches with a release agent that is safe for platinum silicones."]
    if o.seal == "cord":
        lines.append(f"Lay a silicone cord of {o.cord_mm:g} mm into the groove of half A, and one around the base.")
    if (found := made.bolts) is not None:
        lines.append(f"Push {found.number} {o.screw} nuts into the traps of half A, {found.trap_mm:.3g} mm deep.")
    return lines


def thread_lines(made: Mold) -> list[str]:
    """Return how the strips of gauges come into the mold; nothing without gauges."""
    if not made.foils:
        return []
    return ["Thread the strips through half B and then through half A."]


def close_lines(made: Mold) -> list[str]:
    """Return how the halves are joined."""
    o = made.options
    lines = ["Push half A onto the pegs of half B: one peg is thinner, so that it fits one way only."]
    if made.foils and o.plugs:
        lines.append("Stretch the strips. Push the plugs over them, open ends of the slits first, into the pockets.")
    elif made.foils:
        lines.append("Stretch the strips, and seal the slots with tape.")
    if (found := made.bolts) is not None:
        lines.append(f"Tighten {found.number} screws {o.screw} x {found.length_mm:g} from half B, by hand.")
    if o.fasten == "bands":
        lines.append(f"Put rubber bands up to {o.band_mm:g} mm wide into the grooves around the halves.")
    return lines


def pour_lines(made: Mold, pour: Pour) -> list[str]:
    """Return how one pour is made, from the lid to the level of the silicone."""
    what = f"{pour.silicone_mm3 / 1e3:.2f} ml"
    lid = pour.lid if len(made.pours) > 1 else "carrier, with its pins," if made.options.carrier else "lid"
    lines = []
    if any(name.startswith("insert") for name in pour.others):
        lines.append("Push the inserts onto the pegs of the lid: they stay in the finger.")
    if pour.ports is None:
        lines += [
            f"Stand the mold with the open side, the base, up. Pour {what} of the silicone for {pour.name}.",
            f"Push {pour.lid} in slowly: surplus and air leave through the channels at its ends. Let it cure, and pull "
            "the lid off.",
        ]
        return lines
    riser = " and the riser into it" if pour.ports.riser is not None else ""
    bands = ", and hold them with rubber bands" if made.options.fasten != "none" else ""
    lines.append(f"Stand the mold with the open side, the base, up. Push the {lid} on{riser}{bands}; keep it level.")
    until = "every hole of the carrier" if made.options.carrier else "all vents"
    lines.append(
        f"Pour {what} and what the openings take through the hole of {pour.ports.pour_mm:.3g} mm, until silicone "
        f"stands in {until}{' and in the riser' if riser else ''}."
    )
    return lines


def open_lines(made: Mold) -> list[str]:
    """Return how the mold is opened."""
    if made.options.carrier:
        lines = ["After curing pull the pins out, and cut the silicone below the riser; the carrier stays on."]
    else:
        lines = ["After curing cut the silicone below the riser and in the vents, and lift the lid off."]
    if made.foils:
        lines.append("Cut the strips outside the mold.")
    along = f"lide the halves apart along {made.options.split}."
    lines.append(f"Turn a screwdriver in the notches, and s{along}" if made.options.pry else f"S{along}")
    return lines
