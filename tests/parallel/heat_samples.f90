! SPDX-License-Identifier: MIT
!> Copper blocks that conduct, for the tests of heat.
module heat_samples
  use base_kinds, only: i8, nlane, pi, rp
  use base_world, only: world_t
  use grid_geometry, only: make_grid
  use heat_conduction, only: conduct
  use particles_store, only: f_bbar, f_jac, f_mass, f_pos, f_temp, make_tag, n_fields
  use run_balance, only: make_first_partition
  use run_regrid, only: regrid
  use state_parts, only: simulation_t
  use tools_tool, only: tool_t
  implicit none (type, external)
  private

  public :: build, conduct_for, content, noise

  real(rp), parameter, public :: h = 1.0e-3_rp, spacing = 0.5_rp*h   !! cell, distance of particles
                                                                     !! [m]
  type(world_t), public :: world

contains

  !> Copper block of `cells` from (0,0,0) on, 8 particles a cell, at 300 K; each rank makes the
  !> particles of some planes. A tool keeps its two fields behind the others.
  subroutine build(sim, cells, film, tool)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: cells(3)
    real(rp), intent(in) :: film(6)
    type(tool_t), intent(in), optional :: tool
    integer(i8) :: id
    integer :: b, faces, i, j, k, n(3), p
    real(rp) :: margin

    margin = 3.0_rp*h
    sim%scene%grid = make_grid(h, [-margin, -margin, -margin], cells*h + margin)
    allocate (sim%scene%material(1), sim%scene%body(1), sim%scene%symmetry(0), &
              sim%scene%clamp(0), sim%scene%condition(0), sim%backing(0))
    allocate (sim%tool(merge(1, 0, present(tool))))
    if (present(tool)) sim%tool(1) = tool
    associate (copper => sim%scene%material(1))
      copper%rho = 8960.0_rp
      copper%c_p = 386.0_rp
      copper%conductivity = 391.0_rp
      call copper%set_elastic(124.0e9_rp, 0.34_rp)
    end associate
    sim%scene%body(1)%spacing = spacing
    sim%scene%body(1)%film%coefficient = film
    sim%scene%method%conducts = .true.
    call sim%particles%init(n_fields + 2*size(sim%tool))
    n = 2*cells
    call sim%particles%reserve(product(n)/nlane + 2)
    b = 0
    p = nlane
    do i = world%rank, n(1) - 1, world%size
      do j = 0, n(2) - 1
        do k = 0, n(3) - 1
          if (p == nlane) then
            b = b + 1
            p = 0
            sim%particles%body(b) = 1
          end if
          p = p + 1
          id = 1_i8 + k + n(3)*(j + n(2)*int(i, i8))
          faces = sum([1, 2, 4, 8, 16, 32], [i == 0, i == n(1) - 1, j == 0, j == n(2) - 1, k == 0, &
                                             k == n(3) - 1])
          associate (ps => sim%particles%ps(p, :, b))
            ps = 0.0_rp
            ps(f_pos:f_pos + 2) = spacing*([i, j, k] + 0.5_rp)
            ps(f_bbar:f_bbar + 2) = 1.0_rp
            ps(f_jac) = 1.0_rp
            ps(f_temp) = 300.0_rp
            ps(f_mass) = 8960.0_rp*spacing**3
          end associate
          sim%particles%tag(p, b) = make_tag(id, faces)
          sim%particles%count(b) = p
        end do
      end do
    end do
    sim%particles%nblk = b
    call sim%prepare_scratch()
    sim%world = world
    call make_first_partition(sim)
    call regrid(sim)
  end subroutine build

  subroutine conduct_for(sim, dt)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt

    call conduct(sim, dt)
  end subroutine conduct_for

  !> Sum over the particles of all ranks of mass c_p (T - 300 K) shape, shape 1 or cos(pi x/length).
  real(rp) function content(sim, length)
    type(simulation_t), intent(in) :: sim
    real(rp), intent(in), optional :: length
    real(rp) :: total(1), heat
    integer :: b, p

    total = 0.0_rp
    do b = 1, sim%particles%nblk
      associate (ps => sim%particles%ps(:, :, b))
        do p = 1, sim%particles%count(b)
          heat = ps(p, f_mass)*386.0_rp*(ps(p, f_temp) - 300.0_rp)
          if (present(length)) heat = heat*cos(pi*ps(p, f_pos)/length)
          total = total + heat
        end do
      end associate
    end do
    call world%sum(total)
    content = total(1)
  end function content

  !> Number between 0 and 1 that depends on the particle alone.
  pure real(rp) function noise(id)
    integer(i8), intent(in) :: id

    noise = real(modulo(id*id*7919_i8 + id*104729_i8, 99991_i8), rp)/99991.0_rp
  end function noise

end module heat_samples
