# SPDX-License-Identifier: MIT
"""The hook and the volume of heat of CONTRIBUTING.md, built as they stand there, a hook that uses what that does not, and by the other
recipes a law, a shape, a condition on nodes, a known field, a column of the history and a field in the frames.
Links the new files with the libraries of the build, which is what the recipes' lines in CMakeLists.txt do."""

import math
import pathlib
import re
import shlex
import subprocess

import driver
import numpy as np
import pytest
from test_restart import assert_same_run

BUILD = pathlib.Path(driver.EXECUTABLE).parent
pytestmark = pytest.mark.skipif(not (BUILD / "CMakeCache.txt").exists(), reason="the program is not where it was built")
RATE, ACCELERATION, POWER = 4e3, 5e4, 300.0   # [1/s], [m/s2], [W/kg]
STEP, STEPS = 1e-7, 400   # [s]

# Counts steps in a state, pushes and heats the particles, which have the heat as a field in frames and checkpoints.
METER = """
module hooks_meter
  use base_kinds, only: rp
  use input_key_table, only: key_table_t
  use input_values, only: input_t
  use particles_store, only: f_heat, f_mass, f_vel
  use state_parts, only: hook_t, simulation_t
  use state_scene, only: scene_t
  implicit none (type, external)
  private
  public :: meter_t
  type, extends(hook_t) :: meter_t
    real(rp) :: push = 0.0_rp, power = 0.0_rp
    integer :: received = 0
  contains
    procedure, nopass :: add_keys
    procedure :: read_keys, give_heat, after_step
  end type meter_t
contains
  subroutine add_keys(t)
    type(key_table_t), intent(inout) :: t
    call t%group('METER', 'repeat', 'For a test.')
    call t%key('PUSH', 'real', 1, 'm/s2', '0', '', 'acceleration along z')
    call t%key('POWER', 'real', 1, 'W/kg', '0', '', 'heat')
  end subroutine add_keys
  subroutine read_keys(self, input, i, scene)
    class(meter_t), intent(inout) :: self
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    type(scene_t), intent(inout) :: scene
    self%push = input%real('METER', i, 'PUSH')
    self%power = input%real('METER', i, 'POWER')
    self%column = [character(16) :: 'steps', 'heat']
    self%unit = [character(16) :: '', 'J']
    self%state = [0.0_rp]
    call scene%layout%add(1, trim(self%name)//' heat', self%received, 'J')
  end subroutine read_keys
  subroutine give_heat(self, sim, dt)
    class(meter_t), intent(inout) :: self
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt
    real(rp) :: heat
    integer :: b, p
    do b = 1, sim%particles%nblk
      do p = 1, sim%particles%count(b)
        heat = dt*self%power*sim%particles%ps(p, f_mass, b)
        associate (received => sim%particles%ps(p, self%received, b))
          received = received + heat
        end associate
        sim%particles%ps(p, f_heat, b) = sim%particles%ps(p, f_heat, b) + heat
        sim%budget%hooks(self%last + 2) = sim%budget%hooks(self%last + 2) + heat
      end do
    end do
  end subroutine give_heat
  subroutine after_step(self, sim, dt)
    class(meter_t), intent(inout) :: self
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt
    integer :: b
    self%state = self%state + 1.0_rp
    if (sim%world%is_root()) sim%budget%hooks(self%last + 1) = self%state(1)
    do b = 1, sim%particles%nblk
      sim%particles%ps(:, f_vel + 2, b) = sim%particles%ps(:, f_vel + 2, b) + dt*self%push
    end do
  end subroutine after_step
end module hooks_meter
"""

# Shakes nodes along x.
SHAKER = """
module state_shaker
  use base_kinds, only: rp
  use input_key_table, only: key_table_t
  use input_values, only: input_t
  use state_clamp, only: add_box_keys, clamp_t
  implicit none (type, external)
  private
  public :: shaker_t
  type, extends(clamp_t) :: shaker_t
    real(rp) :: speed = 0.0_rp, rate = 0.0_rp
  contains
    procedure, nopass :: add_keys
    procedure :: read_keys, velocity_at
  end type shaker_t
contains
  subroutine add_keys(t)
    type(key_table_t), intent(inout) :: t
    call t%group('SHAKER', 'repeat', 'For a test.')
    call add_box_keys(t)
    call t%key('SPEED', 'real', 1, 'm/s', 'required', '', 'amplitude of the velocity')
    call t%key('RATE', 'real', 1, 'rad/s', 'required', '', 'angular frequency')
  end subroutine add_keys
  subroutine read_keys(self, input, i)
    class(shaker_t), intent(inout) :: self
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    call self%read_box(input, 'SHAKER', i)
    self%speed = input%real('SHAKER', i, 'SPEED')
    self%rate = input%real('SHAKER', i, 'RATE')
    self%is_uniform = .false.
  end subroutine read_keys
  pure function velocity_at(self, x, t) result(v)
    class(shaker_t), intent(in) :: self
    real(rp), intent(in) :: x(3), t
    real(rp) :: v(3)
    v = [self%speed*sin(self%rate*t), 0.0_rp*x(2:)]
  end function velocity_at
end module state_shaker
"""

# The longest names that fit into the lists of laws and shapes.
LAW, SHAPE = "creep-of-a-name-of-32-characters", "ball" + 28 * "s"

SCENE = f"""
&RUN TITLE = 'A block that drag slows' /
&GRID CELL = 1e-3, LOWER = -4e-3, -4e-3, -4e-3, UPPER = 12e-3, 8e-3, 8e-3 /
&TIME DT = {STEP}, END = {STEP * STEPS} /
&MATERIAL NAME = 'copper', DENSITY = 8960, YOUNGS_MODULUS = 124e9, POISSON_RATIO = 0.34, SPECIFIC_HEAT = 386, CONDUCTIVITY = 391 /
&BODY NAME = 'block', MATERIAL = 'copper', TEMPERATURE = 300, VELOCITY = 30, 10, 0 /
&SHAPE BODY = 'block', LOWER = 0, 0, 0, UPPER = 4e-3, 4e-3, 4e-3 /
&HEAT AMBIENT = 300 /
&DRAG LOWER = -1, -1, -1, UPPER = 1, 1, 1, RATE = {RATE} /
&METER PUSH = {ACCELERATION} /
&METER POWER = {POWER} /
&PROBE NAME = 'middle', POSITION = 2e-3, 2e-3, 2e-3 /
&OUTPUT HISTORY_INTERVAL = {STEP * STEPS / 4}, CHECKPOINT_INTERVAL = {STEP * STEPS} /
"""


def recipes():
    """Files in the order in which they compile, by layer and name: the Fortran blocks of the recipes, and the lists with the lines that
    they ask for, also for the other hook."""
    drag, gauss = re.findall(r"^```fortran\n(.*?)^```", (driver.ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8"), re.M | re.S)
    hooks = [before("    call add('SOURCE'", f"    call add('{name.upper()}', {name}_t())") for name in ("drag", "meter")]
    hooks += [before("  use hooks_source,", f"  use hooks_{name}, only: {name}_t") for name in ("drag", "meter")]
    law, laws = renamed("physics", "law", "norton", LAW)
    shape, shapes = renamed("tools", "shape", "sphere", SHAPE)
    fields = source("setup/fields")
    maker = re.search(r"  !> Expanding ring\..*?end function ring\n", fields, re.S)[0]
    return {("physics", "law_twin"): law, ("physics", "laws"): laws, ("tools", "shape_twin"): shape, ("tools", "shapes"): shapes,
            ("heat", "gauss"): gauss,
            ("heat", "volumes"): source("heat/volumes", before("  use heat_volume,", "  use heat_gauss, only: gauss_t"),
                                        ("volume_names(1) = [character(32) :: 'ball'", "volume_names(2) = [character(32) :: 'ball', 'gauss'"),
                                        before("    case default;", "    case ('gauss'); allocate (gauss_t :: volume)")),
            ("state", "shaker"): SHAKER,
            ("state", "conditions"): source("state/conditions", ("clamp_groups(1)", "clamp_groups(2)"), (":: 'CLAMP'", ":: 'CLAMP', 'SHAKER'"),
                                                 before("  implicit none", "  use state_shaker, only: shaker_t"),
                                                 before("    case default", "    case ('SHAKER'); allocate (clamp, source=shaker_t())")),
            ("setup", "boundary"): source("setup/boundary"), ("setup", "heat_scene"): source("setup/heat_scene"),
            ("physics", "field_twin"): re.sub(r"ring_t|field_ring", lambda word: word[0].replace("ring", "twin"), source("physics/field_ring")),
            ("setup", "keys_body"): source("setup/keys_body", ("vortex ring mode", "vortex ring twin mode"), ("or ring", "or ring or twin")),
            ("setup", "fields"): source("setup/fields", before("  use physics_field_vortex,", "  use physics_field_twin, only: twin_t"),
                                        before("      case default", "      case ('twin'); allocate (field, source=twin(input, i, material))"),
                                        before("end module", re.sub(r"\bring(?=[%(_\n])", "twin", maker))),
            ("io", "frames"): source("io/frames", before("    call write_scalar(file, 'pressure'",
                                                         "    call write_scalar(file, 'abscissa', 'm', field_of(particles, f_pos))")),
            ("output", "history"): source("output/history", before("      call row%add('kinetic',",
                                                                   "      call row%add('momentum_x', 'Ns', now%motion(1))")),
            ("hooks", "source"): source("hooks/source"), ("hooks", "drag"): drag, ("hooks", "meter"): METER,
            ("hooks", "list"): source("hooks/list", *hooks)}


def source(name, *changes):
    """A file of the program with pairs of texts (old, new) exchanged."""
    text = (driver.ROOT / f"modules/{name}.f90").read_text(encoding="utf-8")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    return text


def before(line, new):
    """The exchange that sets a new line before those that begin so."""
    return line, new + "\n" + line


def renamed(layer, kind, old, name):
    """A law or a shape by the recipes: that of the name `old` with new names of module, type, keys and choice, and the list with both."""
    one, many = source(f"{layer}/{kind}_{old}"), source(f"{layer}/{kind}s")
    one = re.sub(rf"(_|\b){old}_t\b", "twin_t", one.replace(f"{layer}_{kind}_{old}", f"{layer}_{kind}_twin"))
    one = re.sub(rf"'{old}'", f"'{name}'", one.replace(f"{old.upper()}_", "TWIN_").replace(f"= {old}'", f"= {name}'"))
    many = many.replace(f"  use {layer}_{kind}_{old},", f"  use {layer}_{kind}_twin, only: twin_t\n  use {layer}_{kind}_{old},")
    many = many.replace(f"    case ('{old}')", f"    case ('{name}'); allocate (twin_t :: {kind})\n    case ('{old}')")
    count = int(re.search(rf"{kind}_names\((\d+)\) =", many)[1])
    return one, many.replace(f"{kind}_names({count}) =", f"{kind}_names({count + 1}) =").replace(f"'{old}', ", f"'{old}', '{name}', ", 1)


def words_of(file, name):
    """Words of a variable in what CMake wrote for make."""
    return shlex.split(re.search(rf"^{name} = (.*)$", file.read_text(encoding="utf-8"), re.M)[1])


def call(words, folder):
    done = subprocess.run([str(word) for word in words], cwd=folder, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    return done.stderr


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """The executable with the hooks, without a warning of the compiler."""
    place = tmp_path_factory.mktemp("hooks")
    link = shlex.split((BUILD / "CMakeFiles/stirpoint.dir/link.txt").read_text(encoding="utf-8"))
    objects = []
    for (layer, name), text in recipes().items():
        (place / f"{name}.f90").write_text(text, encoding="utf-8")
        flags = BUILD / f"CMakeFiles/{layer}.dir/flags.make"
        words = [word for word in words_of(flags, "Fortran_FLAGS") if not word.startswith("-J")] + [f"-J{place}", f"-I{place}"]
        assert call([link[0], *words, *words_of(flags, "Fortran_INCLUDES"), "-c", f"{name}.f90"], place) == ""
        objects.append(place / f"{name}.o")
    link[link.index("-o") + 1] = str(place / "stirpoint")
    call([link[0], *objects, *link[1:]], BUILD)
    (place / "share").symlink_to(BUILD / "share")
    (place / "flight.nml").write_text(SCENE, encoding="utf-8")
    return place


@pytest.fixture
def run(built, tmp_path, monkeypatch):
    monkeypatch.setattr(driver, "EXECUTABLE", str(built / "stirpoint"))

    def call_program(*options, folder="whole", scene=built / "flight.nml", **more):
        (tmp_path / folder).mkdir(exist_ok=True)
        return driver.run(scene, "--quiet", *options, directory=tmp_path / folder, **more).results("flight")

    return call_program


@pytest.mark.parametrize("ranks", [None, 2])
def test_drag(run, ranks):
    """Exact to rounding: in each step the drag takes velocity [m/s] and kinetic energy [J], then a push adds to the velocity along z;
    heat [J] follows from the power, one count from each step, and the sums of two hooks of a kind are their own."""
    done = run(ranks=ranks)
    history, state = done.history(), done.checkpoint()
    mass, velocity, work, kept = 8960 * 64e-9, np.array([30.0, 10.0, 0.0]), 0.0, math.exp(-RATE * STEP)
    for _ in range(STEPS):
        work += 0.5 * mass * (kept**2 - 1) * velocity @ velocity
        velocity = kept * velocity + [0.0, 0.0, STEP * ACCELERATION]
    assert state.momentum() == pytest.approx(mass * velocity, rel=1e-9)
    assert history["drag1_work[J]"][-1] == history["body_work[J]"][-1] == pytest.approx(work, rel=1e-9)
    assert history["meter1_steps"][-1] == history["meter2_steps"][-1] == STEPS
    assert history["meter2_heat[J]"][-1] == pytest.approx(POWER * mass * state.of_run("the time of the last conduction step [s]"), rel=1e-9)
    assert np.all(history["meter1_heat[J]"] == 0.0)


def test_field(run):
    """Exact: a field in the frames by the recipe, the coordinate along x, has its unit and equals that of the points. The field of a hook
    [J], in float: its sum is that of the history."""
    done = run(sets={"OUTPUT.FRAME_INTERVAL": STEP * STEPS})
    data, units, _ = driver.read_frame(done.path("_000001.hdf"))
    assert units["meter2_heat"] == "J" and np.all(data["meter1_heat"] == 0.0) and np.all(data["meter2_heat"] > 0.0)
    assert data["meter2_heat"].sum(dtype=float) == pytest.approx(done.history()["meter2_heat[J]"][-1], rel=1e-6)
    assert units["abscissa"] == "m" and np.ptp(data["abscissa"]) > 0.0 and np.array_equal(data["abscissa"], data["x"][:, 0])


def test_restart(run):
    """Exact: stopped half way and continued, the run ends with the same doubles and histories as in one go."""
    whole = run(sets={"TIME.MAX_STEPS": 0})
    part = run(folder="part", sets={"TIME.MAX_STEPS": STEPS // 2})
    run("--restart", part.path("_checkpoint.h5"), folder="part", sets={"TIME.MAX_STEPS": 0})
    assert_same_run(whole, part)


HEATED = """
&RUN NAME = 'flight' /
&GRID CELL = 0.5e-3, LOWER = -1e-3, -1e-3, -1e-3, UPPER = 9e-3, 9e-3, 9e-3 /
&TIME END = 2e-4, MASS_SCALING = 1e6 /
&MATERIAL NAME = 'm', DENSITY = 2700, YOUNGS_MODULUS = 70e9, POISSON_RATIO = 0.33, SPECIFIC_HEAT = 900, CONDUCTIVITY = 1e-3, T_MELT = 900 /
&BODY NAME = 'b', MATERIAL = 'm', TEMPERATURE = 300 /
&SHAPE BODY = 'b', LOWER = 0, 0, 0, UPPER = 8e-3, 8e-3, 8e-3 /
&HEAT AMBIENT = 300, INTEGRATOR = 'backward-euler' /
&SOURCE KIND = 'gauss', POWER = 50000, POSITION = 4e-3, 4e-3, 4e-3, RADIUS = 3e-3 /
"""


@pytest.mark.parametrize("sets, spacing, least", [({"HEAT.EVERY": 1}, 0.25e-3, 0.85), ({"METHOD.MECHANICS": "F"}, 0.5e-3, 0.99)])
def test_volume(run, tmp_path, sets, spacing, least):
    """Beside mechanics and alone, nearly without conduction: the heat [J] is the power times the time; the particle or cell nearest to the
    centre, half a diagonal of the `spacing` [m] away, rises as under a Gaussian that is cut off at 5 %, whose integral is
    (erf(sqrt(3)) - 2 sqrt(3/pi) exp(-3)) (pi/3)^1.5 R^3, to 1 %; nodes smooth the heat of particles, by less than 15 %."""
    (tmp_path / "heated.nml").write_text(HEATED, encoding="utf-8")
    history = run(scene=tmp_path / "heated.nml", sets=sets).history()
    heat = 50000 * 2e-4
    assert history["source_heat[J]"][-1] == pytest.approx(heat, rel=1e-12)
    share = math.erf(math.sqrt(3)) - 2 * math.sqrt(3 / math.pi) * math.exp(-3)
    rise = heat / (2700 * 900 * share * (math.pi / 3)**1.5 * 27e-9) * math.exp(-3 * 0.75 * (spacing / 3e-3)**2)
    assert least * rise < history["temperature_max[K]"][-1] - 300 < 1.01 * rise


def test_names(run, built, tmp_path):
    """Exact: the new law and shape have the keys and give the doubles of those that they rename."""
    def text(law, prefix, shape):
        return f"""&GRID CELL = 1e-3, LOWER = -4e-3, -4e-3, -4e-3, UPPER = 8e-3, 8e-3, 8e-3 /
&TIME DT = {STEP}, END = {STEP * 20} /
&MATERIAL NAME = 'm', DENSITY = 8960, YOUNGS_MODULUS = 124e9, POISSON_RATIO = 0.34, SPECIFIC_HEAT = 386, T_MELT = 1356,
  LAW = '{law}', {prefix}_K = 1e8, {prefix}_N = 0.2 /
&BODY NAME = 'block', MATERIAL = 'm' /
&SHAPE BODY = 'block', LOWER = 0, 0, 0, UPPER = 4e-3, 4e-3, 4e-3 /
&TOOL NAME = 'tool', KIND = '{shape}', POSITION = 2e-3, 2e-3, 6e-3, RADIUS = 2e-3, FRICTION = 0.3 /
&MOTION TOOL = 'tool', VELOCITY = 0, 0, -20 /
"""
    state = []
    for words in (("norton", "NORTON", "sphere"), (LAW, "TWIN", SHAPE)):
        (tmp_path / "flight.nml").write_text(text(*words), encoding="utf-8")
        state.append(run(scene=tmp_path / "flight.nml", folder=words[0]).checkpoint().all)
    for name in ("global", "ranks/local", "particles/state"):
        assert np.array_equal(state[0][name], state[1][name])
    assert np.ptp(state[0]["particles/state"]) > 0.0


SHAKEN = f"""
&RUN NAME = 'flight' /
&GRID CELL = 1e-3, LOWER = -2e-3, -2e-3, -2e-3, UPPER = 6e-3, 6e-3, 6e-3 /
&TIME DT = {STEP}, END = {STEP * 100} /
&MATERIAL NAME = 'copper', DENSITY = 8960, YOUNGS_MODULUS = 124e9, POISSON_RATIO = 0.34 /
&BODY NAME = 'block', MATERIAL = 'copper' /
&SHAPE BODY = 'block', LOWER = 0, 0, 0, UPPER = 4e-3, 4e-3, 4e-3 /
&SHAKER LOWER = -1, -1, -1, UPPER = 1, 1, 1, SPEED = 3, RATE = 3e5 /
&OUTPUT HISTORY_INTERVAL = {STEP * 10} /
"""


@pytest.mark.parametrize("ranks", [None, 2])
def test_condition(run, tmp_path, ranks):
    """Exact to rounding: nodes that all move along x as the condition says at the beginning of a step give the momentum [N s], a column of
    the history by its recipe, and the impulse [N s], whose mean force is a column of the condition."""
    (tmp_path / "shaken.nml").write_text(SHAKEN, encoding="utf-8")
    history = run(scene=tmp_path / "shaken.nml", ranks=ranks).history()
    time, momentum = history["time[s]"], history["momentum_x[Ns]"]
    scale = 8960 * 64e-9 * 3.0
    assert momentum[1:] == pytest.approx(scale * np.sin(3e5 * (time[1:] - STEP)), rel=1e-9, abs=1e-9 * scale) and momentum[0] == 0.0
    assert history["shaker1_force_x[N]"][1:] * np.diff(time) == pytest.approx(np.diff(momentum), rel=1e-6, abs=1e-8 * scale)


def test_known_field(run, tmp_path):
    """Exact: a known field that renames another has its keys and gives its doubles and errors."""
    text = (driver.ROOT / "tests/system/inputs/ring.nml").read_text(encoding="utf-8")
    done = []
    for kind in ("ring", "twin"):
        (tmp_path / "flight.nml").write_text(text.replace("KIND = 'ring'", f"KIND = '{kind}'"), encoding="utf-8")
        done.append(run(scene=tmp_path / "flight.nml", folder=kind, sets={"TIME.MAX_STEPS": 5}))
    states = [one.checkpoint().all["particles/state"] for one in done]
    assert np.array_equal(*states) and np.ptp(states[0]) > 0.0
    assert len({one.path("_errors.csv").read_bytes() for one in done}) == 1


@pytest.mark.parametrize("sets, message", [({"DRAG.RATE": -1}, "&DRAG RATE = -1: must be >= 0"),
                                           ({"METHOD.MECHANICS": "F"}, "&DRAG has no effect with MECHANICS = F")])
def test_mistake(run, built, tmp_path, sets, message):
    """Exact: keys of a hook are checked as all others; heat alone has no hooks but sources."""
    done = driver.run(built / "flight.nml", directory=tmp_path, sets=sets, expect=driver.BAD_INPUT)
    assert message in done.err
