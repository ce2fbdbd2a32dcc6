"""Text of the steps of casting, for the sheet and the page of a mold."""

from __future__ import annotations

from finger3d.mold.parts import Mold, Pour


def prepare_lines(mold: Mold) -> list[str]:
    """Return what is done to the open halves."""
    o = mold.options
    lines = ["Spray every face that silicone touches with a release agent that is safe for platinum silicones."]
    if o.seal == "cord":
        lines.append(f"Lay a silicone cord of {o.cord_mm:g} mm into the groove of half A, and one around the base.")
    if (bolts := mold.bolts) is not None:
        lines.append(f"Push {bolts.number} {o.screw} nuts into the traps of half A, {bolts.trap_mm:.3g} mm deep.")
    return lines


def thread_lines(mold: Mold) -> list[str]:
    """Return how the strips of gauges come into the mold; nothing without gauges."""
    if not mold.foils:
        return []
    return ["Thread the strips through half B and then through half A."]


def close_lines(mold: Mold) -> list[str]:
    """Return how the halves are joined."""
    o = mold.options
    lines = ["Push half A onto the pegs of half B: one peg is thinner, so that it fits one way only."]
    if mold.foils and o.plugs:
        lines.append("Stretch the strips. Push the plugs over them, open ends of the slits first, into the pockets.")
    elif mold.foils:
        lines.append("Stretch the strips, and seal the slots with tape.")
    if (bolts := mold.bolts) is not None:
        lines.append(f"Tighten {bolts.number} screws {o.screw} x {bolts.length_mm:g} from half B, by hand.")
    if o.fasten == "bands":
        lines.append(f"Put rubber bands up to {o.band_mm:g} mm wide into the grooves around the halves.")
    return lines


def pour_lines(mold: Mold, pour: Pour) -> list[str]:
    """Return how one pour is made, from the lid to the level of the silicone."""
    what = f"{pour.silicone_mm3 / 1e3:.2f} ml"
    lid = pour.lid if len(mold.pours) > 1 else "carrier, with its pins," if mold.options.carrier else "lid"
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
    bands = ", and hold them with rubber bands" if mold.options.fasten != "none" else ""
    lines.append(f"Stand the mold with the open side, the base, up. Push the {lid} on{riser}{bands}; keep it level.")
    until = "every hole of the carrier" if mold.options.carrier else "all vents"
    lines.append(
        f"Pour {what} and what the openings take through the hole of {pour.ports.pour_mm:.3g} mm, until silicone "
        f"stands in {until}{' and in the riser' if riser else ''}."
    )
    return lines


def open_lines(mold: Mold) -> list[str]:
    """Return how the mold is opened."""
    if mold.options.carrier:
        lines = ["After curing pull the pins out, and cut the silicone below the riser; the carrier stays on."]
    else:
        lines = ["After curing cut the silicone below the riser and in the vents, and lift the lid off."]
    if mold.foils:
        lines.append("Cut the strips outside the mold.")
    along = f"lide the halves apart along {mold.options.split}."
    lines.append(f"Turn a screwdriver in the notches, and s{along}" if mold.options.pry else f"S{along}")
    return lines
