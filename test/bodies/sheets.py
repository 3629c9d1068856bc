"""Two sheets that are bent together (input/sheets.nml): how far they slide on each other is their thickness
times the angle of the end."""

from meeting import *

THICK, LONG = 3e-3, 24e-3  # m, of a sheet


def end_of(run, body):
    """The middle of the end of a sheet (m) and the direction along the sheet there, by a linear map of its
    particles, x and z."""
    first, last = (Particles(sorted(run.directory.glob("particles_*.hdf"))[n]) for n in (0, -1))
    order = {one: n for n, one in enumerate(last.ids)}
    row = (first["body"] == body) & (first["position"][:, 0] > LONG - 1.5e-3)
    now = last["position"][[order[one] for one in first.ids[row]]][:, [0, 2]]
    before = first["position"][row][:, [0, 2]]
    about = np.array([LONG - 1e-3, before[:, 1].mean()])
    fit = np.linalg.lstsq(np.column_stack([np.ones(len(before)), before - about]), now, rcond=None)[0]
    return fit[0], fit[1] / np.linalg.norm(fit[1])


def sheets(name, groups=True, end=0.035):
    """Angle of the end of two sheets and how far the upper one stands back there (m)."""
    text = (
        (ROOT / "input/sheets.nml")
        .read_text()
        .replace("'out/sheets'", "'OUT'")
        .replace("end_time=0.07", f"end_time={end}")
    )
    if not groups:
        text = re.sub(r", contact_group='\w+'", "", text)
    run = Run(name, text)
    (low, along), (high, _) = end_of(run, 1), end_of(run, 2)
    slip, angle = (low - high) @ along, -math.atan2(along[1], along[0])
    print(
        f"   {name}: angle of the end {angle:.4f}, slip {slip * 1e3:.4f} mm, {slip / (THICK * angle):.4f} of "
        "thickness times angle",
        flush=True,
    )
    return angle, slip


def bent():
    angle, slip = sheets("bent")
    require("sheets: the end turns by more than 0.2", angle > 0.2)
    check("sheets: slip at the end over thickness times angle, off 1", slip / (THICK * angle) - 1, 0.02)
    one, slip = sheets("one_sheet", groups=False)
    require(
        "control: one sheet bends by about a quarter, and does not slip",
        one < 0.4 * angle and abs(slip) < 0.1 * THICK * one,
    )


CASES = {"bent": bent}
if __name__ == "__main__":
    main(CASES)
