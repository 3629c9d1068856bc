"""What a study climbs: the file beside a scene (doc/user/accuracy_cost.md, Settings), or, where there is
none, ladders by default."""

import dataclasses
import tomllib

from .run_data import Unreadable
from .scene_text import BadSetting, Scene

kinds = ("load", "probe", "energy", "frequency", "printed")


def is_number(value):
    """Whether a value of a study's file is a number."""
    return isinstance(value, (int, float)) and not isinstance(value, bool)


@dataclasses.dataclass
class Quantity:
    """What is compared, and with what."""

    name: str
    kind: str
    # "richardson", "theory", a number, the path of a table, a table of knobs of a run of its own
    reference: object = "richardson"
    reference_error: float = 0.0  # per cent
    window: tuple = (0.5, 1.0)  # share of the last depth or time that is compared
    tool: str = ""  # load: the first when empty
    column: str = ""  # probe, energy, frequency
    probe: str = ""  # a probe of the scene, or, with `point`, eight about it
    point: tuple = ()  # m
    theory: str = ""  # of a probe; see study_quantity
    smooth: float = 0.02  # load: a line is fitted over so much of the last depth to either side

    def check(self):
        if self.kind not in kinds:
            raise BadSetting(f"quantity {self.name}: kind='{self.kind}'; allowed: {', '.join(kinds)}")
        if self.kind in ("probe", "energy", "frequency") and not self.column:
            raise BadSetting(f"quantity {self.name}: kind='{self.kind}' needs a column")
        if self.point and not (len(self.point) == 3 and all(map(is_number, self.point))):
            raise BadSetting(f"quantity {self.name}: point={list(self.point)}; must be three numbers (m)")
        if not 0 <= self.window[0] < self.window[1] <= 1:
            raise BadSetting(f"quantity {self.name}: window={list(self.window)}; must rise within 0 to 1")


@dataclasses.dataclass
class Family:
    """Runs that differ in one knob."""

    name: str
    settings: dict
    climb: str
    values: list

    def rungs(self):
        return [{**self.settings, self.climb: value} for value in self.values]


@dataclasses.dataclass
class Setting:
    title: str
    base: dict  # knobs of every run
    families: list  # the first is the main one
    shares: dict  # name -> knobs that halve (or better) one thing
    about: dict  # the rung that shares stand about; {} for the last but one of the main family
    comparisons: list  # pairs of names of families
    targets: list  # per cent
    budgets: list  # seconds
    balance_limit: float  # per cent; a run whose energy balance is worse late on is not taken for the front
    level_boxes: list  # [lower, upper] (m) of levels that `levels` may add
    factors: list = dataclasses.field(default_factory=list)  # cells that `make solve` tries, over the scene's
    # another program than gimp3d, which reads what the scene file says and prints lines `study: NAME VALUE`
    program: str = ""
    ranks: int = 1
    lenient: bool = False  # a rung that the program refuses is left out, and told; else it ends the study


def known(where, table, allowed):
    for name in table:
        if name not in allowed:
            raise BadSetting(f"{where}: unknown {name}; allowed: {', '.join(allowed)}")


def make(where, kind, name, table, **more):
    fields = [field.name for field in dataclasses.fields(kind) if field.name != "name"]
    known(where, table, fields)
    try:
        one = kind(
            name=name, **more, **{key: tuple(v) if isinstance(v, list) else v for key, v in table.items()}
        )
    except TypeError:
        raise BadSetting(f"{where}: a kind is missing; allowed: {', '.join(kinds)}")
    one.check()
    return one


def read(path):
    """The settings of a file, and its quantities by name."""
    try:
        table = tomllib.loads(path.read_text())
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise Unreadable(f"{path}: {error}")
    known(
        str(path),
        table,
        (
            "title",
            "base",
            "cells",
            "families",
            "shares",
            "about",
            "comparisons",
            "targets",
            "budgets",
            "balance_limit",
            "level_boxes",
            "factors",
            "program",
            "ranks",
            "quantity",
        ),
    )
    if not table.get("quantity") or not table.get("families"):
        raise BadSetting(f"{path}: [quantity.NAME] and [families.NAME] must stand there")
    families = [
        family(f"{path}, families.{name}", name, one, table.get("cells"))
        for name, one in table["families"].items()
    ]
    names = [one.name for one in families]
    comparisons = [tuple(pair) for pair in table.get("comparisons", [])]
    for pair in comparisons:
        if len(pair) != 2 or set(pair) - set(names):
            raise BadSetting(
                f"{path}: comparisons {list(pair)}; must be two of the families {', '.join(names)}"
            )
    setting = Setting(
        title=table.get("title", path.stem),
        base=table.get("base", {}),
        families=families,
        shares=table.get("shares", {}),
        about=table.get("about", {}),
        comparisons=comparisons,
        targets=table.get("targets", [1.0]),
        budgets=table.get("budgets", [60.0]),
        balance_limit=table.get("balance_limit", 5.0),
        level_boxes=table.get("level_boxes", []),
        factors=factors_of(path, table.get("factors", [])),
        program=table.get("program", ""),
        ranks=table.get("ranks", 1),
    )
    wanted = {
        name: make(f"{path}, quantity.{name}", Quantity, name, one) for name, one in table["quantity"].items()
    }
    if len({one.point for one in wanted.values() if one.point}) > 1:
        raise BadSetting(f"{path}: all quantities must have the same point")
    return setting, wanted


def factors_of(path, factors):
    if all(isinstance(one, (int, float)) and one > 0 for one in factors):
        return sorted(factors, reverse=True)
    raise BadSetting(f"{path}: factors {factors}; must be numbers above 0")


def family(where, name, table, cells):
    settings = {key: value for key, value in table.items() if key not in ("climb", "values")}
    climb, values = table.get("climb", "cell"), table.get("values", cells)
    if not values:
        raise BadSetting(f"{where}: no values to climb, and no cells above")
    return Family(name, settings, climb, values)


def by_default(text, quantity_name):
    """Ladders for a scene without a file: every knob that it has."""
    case = Scene(text).values()
    try:
        cell = case["grid"][0]["cell_size"][0]
        particles = int(case["body"][0].get("particles_per_cell", [8])[0])
    except KeyError as error:
        raise Unreadable(f"the scene lacks {error}")
    time = case.get("time", [{}])[0]
    cells, middle = [2 * cell, cell, 2 * cell / 3, cell / 2], {"cell": cell}
    families = [
        Family("as given", {}, "cell", cells),
        Family(
            "1 a cell" if particles != 1 else "8 a cell",
            {"particles": 1 if particles != 1 else 8},
            "cell",
            cells,
        ),
    ]
    if "affine" == time.get("transfer", ["affine"])[0]:
        families.append(Family("plain", {"transfer": "plain"}, "cell", cells))
    if "fixed" == time.get("domain", ["fixed"])[0]:
        families.append(Family("stretch", {"domain": "stretch"}, "cell", cells[:2]))
    for fewer in range(len(case.get("level", []))):
        families.append(Family(f"{fewer} levels", {"levels": fewer}, "cell", cells))
    families.append(Family("safety", middle, "safety", [0.1, 0.2, 0.35]))
    if time.get("stress_update", ["usl"])[0] != "musl" and time.get("velocity_update", ["flip"])[0] == "flip":
        families.append(Family("flip fraction", middle, "flip_fraction", [0.99, 1.0]))
    shares = {"time step": {"safety": 0.175}}
    if "tool" in case:
        families += [
            Family("speed", middle, "speed", [0.5, 1.0, 2.0]),
            Family("contact tolerance", middle, "tolerance", [1e-4, 1e-8, 1e-10]),
        ]
        shares["contact"] = {"tolerance": 1e-11}
    if "tool" in case or "pressure" in case:
        shares["inertia"] = {"speed": 0.5}
    kind = "load" if "tool" in case else "energy"
    name = quantity_name or kind
    if name not in ("load", "energy"):
        raise BadSetting(f"QUANTITY={name}: without a file beside the scene it is load or energy")
    quantity = Quantity(name, name, column="" if name == "load" else "strain")
    setting = Setting(
        title=(case.get("scene", [{}])[0].get("title") or ["untitled"])[0],
        base={},
        families=families,
        shares=shares,
        about={},
        comparisons=[(families[0].name, one.name) for one in families[1:] if one.climb == "cell"],
        targets=[1.0],
        budgets=[60.0],
        balance_limit=5.0,
        level_boxes=[],
        lenient=True,
    )
    return setting, {name: quantity}
