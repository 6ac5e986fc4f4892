! SPDX-License-Identifier: MIT
!> The table of all groups and keys of the input file. A new key is a new row in one of the files of
!> this folder; checks, defaults and the reference page follow. A restart may change the keys that
!> `may_change`: they control the rest of the run, not the state. Of &MOTION all future phases may
!> change, of &SOURCE an END in the future (checks_same_scene).
module groups_table
  use groups_body, only: add_body, add_fields, add_material
  use groups_boundary, only: add_boundary
  use groups_heat, only: add_heat
  use groups_output, only: add_output, add_paths
  use groups_run, only: add_method, add_run
  use groups_tool, only: add_tool
  use keys_table, only: key_table_t
  implicit none (type, external)
  private

  public :: key_table

contains

  !> The table. Columns: name, type, number of values (-n: up to n), unit, default, allowed,
  !> meaning.
  function key_table() result(t)
    type(key_table_t) :: t

    call add_run(t)
    call add_method(t)
    call add_material(t)
    call add_body(t)
    call add_tool(t)
    call add_boundary(t)
    call add_fields(t)
    call add_heat(t)
    call add_output(t)
    call add_paths(t)
  end function key_table

end module groups_table
