"""The architecture is what docs/architecture.md says and keeps its rules; each rule is tested."""

import re
import shutil
import sys

import pytest

import driver

sys.path.insert(0, str(driver.ROOT / "docs"))
import architecture  # noqa: E402


@pytest.fixture(name="tree")
def fixture_tree(tmp_path):
    """A copy of the files from which the architecture is derived."""
    for folder in ("modules", "docs", "src", "benchmarks", "tests/unit", "tests/parallel"):
        shutil.copytree(driver.ROOT / folder, tmp_path / folder, ignore=shutil.ignore_patterns("pictures", "inputs"))
    for file in ("CMakeLists.txt", "tests/CMakeLists.txt", "tests/check.f90"):
        shutil.copy(driver.ROOT / file, tmp_path / file)
    return tmp_path


def test_sources_keep_the_rules():
    assert architecture.problems(driver.ROOT) == []


def edit(tree, name, old, new):
    path = tree / name
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")


def use_upwards(tree):
    edit(tree, "modules/state/probes.f90", "  use grid_geometry", "  use io_histories, only: row_t\n  use grid_geometry")


def unused_layer(tree):
    edit(tree, "CMakeLists.txt", "USES base particles input state heat)", "USES base particles input tools state heat)")


def unused_library(tree):
    edit(tree, "CMakeLists.txt", "  USES base grid)", "  USES base grid hdf5::fortran)")


def unused_by_a_test(tree):
    edit(tree, "tests/CMakeLists.txt", "1 USES sleep)", "1 USES sleep input)")


def staircase(tree):
    edit(tree, "modules/grid/halo.f90", "  implicit none", "  !! of two lines\n  implicit none")


def strided_section(tree):
    edit(tree, "modules/sleep/cubes.f90", "contains\n",
         "contains\n  subroutine first(a)\n    associate (x => a%b(1, 2:4))\n      call second(norm2(x), x)\n"
         "    end associate\n  end subroutine first\n")


def cycle(tree):
    edit(tree, "modules/grid/halo.f90", "  use base_kinds", "  use particles_store, only: particles_t\n  use base_kinds")


def whole_simulation(tree):
    edit(tree, "modules/state/probes.f90", "    type(probes_t), intent(inout) :: probes\n",
         "    type(probes_t), intent(inout) :: probes\n    type(simulation_t), intent(inout) :: sim\n")


def fourth_part(tree):
    edit(tree, "modules/boundary/symmetry.f90", "    type(budget_t), intent(inout) :: budget\n",
         "    type(budget_t), intent(inout) :: budget\n    type(probes_t) :: probes\n")


def carries_no_more(tree):
    edit(tree, "modules/run/debris.f90", "type(simulation_t)", "type(probes_t)")


def kernel_renamed(tree):
    edit(tree, "modules/transfer/scatter.F90", "subroutine p2g_block(", "subroutine p2g_any_block(")


def old_table(tree):
    edit(tree, "docs/architecture.md", "| `front` | setup", "| `front` | run, setup")


def unknown_procedure(tree):
    edit(tree, "docs/architecture.md", "accept_step  ", "accept_any   ")


def walk_elsewhere(tree):
    edit(tree, "docs/architecture.md", "next_step              run/loop.f90", "next_step              run/regrid.f90")


def layer_without_a_row(tree):
    edit(tree, "docs/architecture.md", "| `sleep` |", "| sleep |")


def layer_without_content(tree):
    path = tree / "docs/architecture.md"
    path.write_text(re.sub(r"(\| `sleep` \|[^|]*\|)[^|]*\|", r"\1  |", path.read_text(encoding="utf-8")), encoding="utf-8")


SPOILED = {
    "lines": [(use_upwards, "state has no USES io"),
              (whole_simulation, "takes the whole simulation"),
              (fourth_part, "record_impulse takes 4 parts of the simulation"), (carries_no_more, "no procedure of run_debris takes"),
              (staircase, "a comment behind code goes on"), (unused_layer, "hooks is linked to tools,"), (unused_library, "particles is linked to hdf5::fortran,"),
              (strided_section, "first passes x, a name of a section"), (unused_by_a_test, "test_sleep is linked to input,"),
              (old_table, "the table of the layers is out of date"),
              (unknown_procedure, "accept_any is not in modules/step/schedule.f90"),
              (walk_elsewhere, "next_step is not in modules/run/regrid.f90")],
    "kernel": [(kernel_renamed, "names what is not there: transfer_scatter.p2g_block")],
    "layers": [(cycle, "a cycle of layers: grid, particles"), (layer_without_a_row, "the table of layers lacks the content of sleep")],
    "content": [(layer_without_content, "the table of layers lacks the content of sleep")]}


@pytest.mark.parametrize("several", SPOILED)
def test_rule(tree, several):
    """Each of several violations in a source tree is reported."""
    for spoil, _ in SPOILED[several]:
        spoil(tree)
    found = architecture.problems(tree)
    for _, wanted in SPOILED[several]:
        assert any(wanted in problem for problem in found), (wanted, found)


MODULE = """module step_one
contains
  subroutine first(sim, n)
    type(simulation_t), intent(inout) :: sim   !! a comment
                                               !! of two lines
    integer, intent(in) :: n
    sim%a = n; sim%b%c = n; sim%b%d = n; sim%b%c%e(sim%a) = n; sim%f = 'x%y%z'
  end subroutine first
  subroutine second(sim)
    type(simulation_t), intent(inout) :: sim
    sim%a = n; sim%b%c = n; sim%b%d = n; sim%b%c%e(sim%a) = n; sim%f = 'x%y%z'
  end subroutine second
  subroutine third()
  end subroutine third
end module step_one
"""


def test_metrics(tmp_path, capsys):
    """A source with known metrics: two procedures with the same five statements."""
    (tmp_path / "modules/step").mkdir(parents=True)
    (tmp_path / "modules/step/one.f90").write_text(MODULE, encoding="utf-8")
    (tmp_path / "CMakeLists.txt").write_text("add_layer(step\n  SOURCES one)\n", encoding="utf-8")
    architecture.print_metrics(tmp_path)
    values = [re.split(r" {2,}", line)[-1] for line in capsys.readouterr().out.splitlines()]
    assert values == ["15", "1, 1, 15", "3", "1.0, 2", "0", "2", "0, 0, 0, 0", "6, 4, 2", "1", "10, 13"]
