! SPDX-License-Identifier: MIT
!> State of a running simulation: scene, this rank's part of it, clock and budget; and `hook_t`, by
!> which users add physics to a step.
module state_parts
  use base_kinds, only: i8, rp
  use base_timers, only: phase_timer_t
  use base_world, only: world_t
  use input_key_table, only: key_table_t
  use input_values, only: input_t
  use particles_store, only: particles_t
  use particles_tracers, only: tracers_t
  use state_budget, only: budget_t
  use state_clock, only: clock_t
  use state_exchange, only: exchange_t
  use state_inertia, only: inertia_t
  use state_node_pairs, only: n_kept, node_pairs_t
  use state_nodes, only: nodes_t
  use state_probes, only: probes_t
  use state_scene, only: scene_t
  use state_sleepers, only: sleepers_t
  use state_tool_lists, only: tool_contact_t
  use tools_heat_sink, only: backing_t
  use tools_sums, only: n_tool_sums
  use tools_tool, only: tool_t
  implicit none (type, external)
  private

  public :: free_simulation, held_hook_t, history_t, hook_t, simulation_t

  !> Physics that a group of the input adds to a step. An extension overrides the places where it
  !> acts; hooks_list makes one for each group.
  type, abstract :: hook_t
    character(32) :: name = ''               !! group and number, as in 'source1'
    !> Names and units of the sums of the hook over steps and ranks: columns NAME_column of the
    !> history.
    character(16), allocatable :: column(:), unit(:)
    integer :: last = 0  !! index in budget%hooks before the first sum of this hook
    real(rp), allocatable :: state(:)        !! further state for checkpoints, equal on all ranks
  contains
    procedure(add_hook_keys), deferred, nopass :: add_keys
    procedure(read_hook_keys), deferred :: read_keys
    procedure :: after_nodes, give_heat, after_step
  end type hook_t

  !> Pointer to a hook, so that the hook is no part of the simulation that is passed to it.
  type :: held_hook_t
    class(hook_t), pointer :: it => null()
  end type held_hook_t

  abstract interface
    !> Add the group and its keys to the table.
    subroutine add_hook_keys(t)
      import :: key_table_t
      implicit none (type, external)
      type(key_table_t), intent(inout) :: t
    end subroutine add_hook_keys

    !> Read and check the `i`-th group. A hook may add fields of particles to `scene%layout`.
    subroutine read_hook_keys(self, input, i, scene)
      import :: hook_t, input_t, scene_t
      implicit none (type, external)
      class(hook_t), intent(inout) :: self
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      type(scene_t), intent(inout) :: scene
    end subroutine read_hook_keys
  end interface

  !> State from which rows of the history are computed as differences and means.
  type :: history_t
    real(rp) :: kinetic0 = 0.0_rp, elastic0 = 0.0_rp   !! energies at t = 0 [J]
    real(rp) :: audit_scale = 0.0_rp         !! largest energy exchanged so far [J]
    real(rp), allocatable :: frame_times(:)  !! times of the frames written so far [s]
    real(rp) :: row_time = 0.0_rp            !! time of the last row [s]
    integer(i8) :: rows = 0                  !! rows written so far
    real(rp), allocatable :: row_sums(:, :)  !! sums of each tool at the last row, of all ranks
    !> Increase of the sums of each tool between the last two rows.
    real(rp), allocatable :: row_gained(:, :)
    real(rp), allocatable :: row_impulse(:, :)   !! impulses of conditions at the last row [N s]
    type(inertia_t) :: row_inertia           !! from row to row
    type(inertia_t) :: sort_inertia          !! from sort to sort, for adaptive mass scaling
    ! Largest values at rows so far.
    real(rp) :: inertial_ratio = 0.0_rp      !! inertial stress over flow stress
    real(rp) :: early_force = 0.0_rp         !! force of all tools on metal not reached [N]
    !> Molten share of the mass, excess over a melting temperature [K].
    real(rp) :: molten(2) = 0.0_rp
  end type history_t

  !> State of a simulation. Each part belongs to the library of its type; procedures of lower
  !> libraries take only the parts that they use.
  type :: simulation_t
    type(world_t) :: world                   !! ranks of the run
    type(scene_t) :: scene                   !! constant during a run
    type(clock_t) :: clock
    type(tool_t), allocatable :: tool(:)
    type(backing_t), allocatable :: backing(:)  !! bodies behind heat films
    type(held_hook_t), allocatable :: hook(:)
    type(probes_t) :: probes
    type(tracers_t) :: tracers
    type(particles_t) :: particles
    type(nodes_t) :: nodes
    type(sleepers_t) :: sleepers
    type(exchange_t) :: exchange             !! data shared with the other ranks
    type(node_pairs_t) :: pairs              !! nodes where bodies are in contact
    type(tool_contact_t) :: contact          !! particles and nodes in contact with a tool
    type(budget_t) :: budget
    type(history_t) :: history
    type(phase_timer_t) :: timer
  contains
    procedure :: prepare_scratch
  end type simulation_t

contains

  !> Allocate scratch arrays and the budget for the sizes of the scene.
  subroutine prepare_scratch(self)
    class(simulation_t), intent(inout) :: self
    integer :: k, n

    if (allocated(self%budget%impulse)) return
    if (.not. allocated(self%hook)) allocate (self%hook(0))
    n = sum([(size(self%hook(k)%it%column), k=1, size(self%hook))])
    allocate (self%budget%hooks(n), source=0.0_rp)
    allocate (self%clock%now%is_near(size(self%tool)), source=.false.)
    if (allocated(self%scene%tool_of)) self%nodes%n_groups = size(self%scene%tool_of)
    if (.not. allocated(self%scene%warning)) allocate (self%scene%warning(0))
    n = size(self%scene%condition)
    allocate (self%budget%warnings(size(self%scene%warning)), &
              self%budget%warning_place(5, size(self%scene%warning)), &
              self%budget%impulse(3, n), self%history%row_impulse(3, n), &
              self%history%row_sums(n_tool_sums, size(self%tool)), &
              self%nodes%boundary%mirrors%lost(8, size(self%scene%symmetry)), source=0.0_rp)
    allocate (self%history%row_inertia%impulse(3, size(self%tool)), &
              self%history%sort_inertia%impulse(3, size(self%tool)), source=0.0_rp)
    allocate (self%pairs%kept(n_kept, 0))
    call self%nodes%allocate_scratch()
  end subroutine prepare_scratch

  !> Action of the hook after the update of the nodes, before walls, tools and contact: change the
  !> velocities of nodes, lanes 1 to 3 of `g`, and with them the velocity changes, lanes 5 to 7
  !> (state_nodes). A step may be refused and repeated: only the sums are restored.
  subroutine after_nodes(self, sim, dt, g)
    class(hook_t), intent(inout) :: self
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt               !! time step [s]
    real(rp), intent(inout) :: g(8, sim%nodes%patch%nn, sim%nodes%n_groups)
  end subroutine after_nodes

  !> Action of the hook before a conduction step: add heat to the particles, field `f_heat` [J].
  subroutine give_heat(self, sim, dt)
    class(hook_t), intent(inout) :: self
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt               !! time from `sim%clock%heat_time` on [s]
  end subroutine give_heat

  !> Action of the hook at the end of a step: change the particles, or accumulate sums.
  subroutine after_step(self, sim, dt)
    class(hook_t), intent(inout) :: self
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt               !! time step, which ended at `sim%clock%time` [s]
  end subroutine after_step

  !> Free the memory that is not released by deallocation.
  subroutine free_simulation(sim)
    type(simulation_t), intent(inout) :: sim

    call sim%particles%free()
    call sim%nodes%free()
    call sim%pairs%near%free()
  end subroutine free_simulation

end module state_parts
