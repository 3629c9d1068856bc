!> Report on bodies whose surface cuts particles, for the introduction of a run.
module m_fill_report
   use m_kinds, only: wp, i8
   use m_text, only: to_text
   use m_scene, only: scene_t, body_spec_t, grid_spec_t, fill_share
   use m_side_kinds, only: side_kinds
   use m_shape, only: shape_t
   use m_cut_cell, only: find_surface
   use m_level, only: level_t
   use m_model, only: model_t
   use m_console, only: console_t
   implicit none
   private
   public :: introduce_shares

   integer, parameter :: together = 8 !< cells along an edge of a cube, which is tested before its cells
   real(wp), parameter :: notable = 0.05_wp !< share of a body's volume that particles may miss without a
                                            !< warning
   real(wp), parameter :: whole = 1.0e-9_wp !< share of a particle's volume, and of a cell

contains

   !> Collective: bodies with cut particles: their number, the volume of all particles, and the surface found
   !> by cells, with the deficits against the shape's where known.
   subroutine introduce_shares(console, scene, model)
      type(console_t), intent(inout) :: console
      type(scene_t), intent(in) :: scene
      type(model_t), intent(in) :: model
      character(len=:), allocatable :: text
      real(wp) :: held, modelled, surface
      integer(i8) :: all_of_it, cut
      integer :: body
      if (model%time > 0.0_wp) return
      do body = 1, size(scene%bodies)
         associate (spec => scene%bodies(body), team => model%communicator)
            if (spec%fill /= fill_share) cycle
            call count_cut(model%levels, spec, body, scene%grid%cell_size, all_of_it, cut, held)
            held = team%sum_real(held)
            text = 'body       '//spec%name//': '//to_text(team%sum_count(cut))//' of '// &
                   to_text(team%sum_count(all_of_it))//' particles are cut by the surface; volume '// &
                   to_text(held, 6)//' m3'
            modelled = modelled_share(spec%shape, scene%grid)
            if (modelled > 0.0_wp .and. spec%shape%knows_volume()) &
               text = text//off_by(held, modelled*spec%shape%volume())
            if (modelled > 0.0_wp .and. spec%shape%area() > 0.0_wp &
                .and. .not. lies_on_a_side(spec%shape, scene%grid)) then
               surface = team%sum_real(surface_of(spec%shape, scene%grid, team%rank, team%ranks))
               text = text//'; surface '//to_text(surface, 6)//' m2' &
                      //off_by(surface, modelled*spec%shape%area())
            end if
            call console%line(text)
            if (.not. (modelled > 0.0_wp .and. spec%shape%knows_volume())) cycle
            if (abs(held/(modelled*spec%shape%volume()) - 1.0_wp) > notable) &
               call console%line('WARNING: volume and mass of '//spec%name//' are off those of its '// &
                                 'shape by as much; try smaller cells, or more particles_per_cell')
         end associate
      end do
   end subroutine introduce_shares

   pure function off_by(value, exact) result(text)
      real(wp), intent(in) :: value, exact
      character(len=:), allocatable :: text
      text = ', '//to_text(100.0_wp*(value/exact - 1.0_wp), 3)//' % off the exact one'
   end function off_by

   !> A body's particles on this rank, the number of cut ones, and their volume, m3.
   pure subroutine count_cut(levels, spec, body, cell, all_of_it, cut, held)
      type(level_t), intent(in) :: levels(:)
      type(body_spec_t), intent(in) :: spec
      integer, intent(in) :: body
      real(wp), intent(in) :: cell !< of the coarsest level, m
      integer(i8), intent(out) :: all_of_it, cut
      real(wp), intent(out) :: held
      real(wp) :: halvings
      integer :: b, l, p
      all_of_it = 0
      cut = 0
      held = 0.0_wp
      do l = 1, size(levels)
         do b = 1, size(levels(l)%blocks)
            associate (particles => levels(l)%blocks(b)%particles, v => levels(l)%layout%volume)
               do p = 1, particles%count
                  if (particles%body(p) /= body) cycle
                  all_of_it = all_of_it + 1
                  held = held + particles%column(p, v)
                  if (spec%section%is_flat()) then ! of squares
                     halvings = log(cell**2/real(spec%particles_per_cell, wp)**(2.0_wp/3.0_wp) &
                                    *spec%section%depth(particles%column(p, levels(l)%layout%position)) &
                                    /particles%column(p, v))/log(4.0_wp)
                  else
                     halvings = log(cell**3/spec%particles_per_cell/particles%column(p, v))/log(8.0_wp)
                  end if
                  if (abs(halvings - nint(halvings)) > whole) cut = cut + 1
               end do
            end associate
         end do
      end do
   end subroutine count_cut

   !> The part of a shape inside the grid, if each side of the grid that cuts it is a symmetry side through
   !> its centre, along its axis or across; 0 where unknown.
   pure real(wp) function modelled_share(shape, grid) result(share)
      class(shape_t), intent(in) :: shape
      type(grid_spec_t), intent(in) :: grid
      real(wp) :: centre(3), lower(3), upper(3), near
      integer :: axis
      logical :: cut(2)
      share = 1.0_wp
      near = whole*grid%cell_size
      call shape%bounding_box(lower, upper)
      centre = shape%centre()
      do axis = 1, 3
         cut = [lower(axis) < grid%lower(axis) - near, upper(axis) > grid%upper(axis) + near]
         if (.not. any(cut)) cycle
         share = 0.5_wp*share
         if (all(cut) .or. min(abs(shape%axis(axis)), 1.0_wp - abs(shape%axis(axis))) > whole) share = 0.0_wp
         if (cut(1) .and. (abs(centre(axis) - grid%lower(axis)) > near &
                           .or. .not. side_kinds(grid%boundary(2*axis - 1))%mirrors)) share = 0.0_wp
         if (cut(2) .and. (abs(centre(axis) - grid%upper(axis)) > near &
                           .or. .not. side_kinds(grid%boundary(2*axis))%mirrors)) share = 0.0_wp
      end do
   end function modelled_share

   !> True when a face of a shape may lie on a side of the grid, where it is no surface.
   pure logical function lies_on_a_side(shape, grid)
      class(shape_t), intent(in) :: shape
      type(grid_spec_t), intent(in) :: grid
      real(wp) :: lower(3), upper(3)
      call shape%bounding_box(lower, upper)
      lies_on_a_side = any(abs(lower - grid%lower) < whole*grid%cell_size) &
                       .or. any(abs(upper - grid%upper) < whole*grid%cell_size)
   end function lies_on_a_side

   !> This rank's part of a shape's surface within the grid, by cells of the coarsest level, m2.
   pure real(wp) function surface_of(shape, grid, rank, ranks) result(surface)
      class(shape_t), intent(in) :: shape
      type(grid_spec_t), intent(in) :: grid
      integer, intent(in) :: rank, ranks
      real(wp) :: area(3), weighted(3), middle(3)
      integer :: cubes(3), first(3), i, j, k, n
      surface = 0.0_wp
      area = 0.0_wp
      weighted = 0.0_wp
      cubes = (grid%cells + together - 1)/together
      do n = rank, product(cubes) - 1, ranks
         first = together*[mod(n, cubes(1)), mod(n/cubes(1), cubes(2)), n/(cubes(1)*cubes(2))]
         middle = grid%lower + (first + 0.5_wp*together)*grid%cell_size
         if (abs(shape%distance(middle)) > sqrt(0.75_wp)*together*grid%cell_size) cycle
         do k = first(3), min(first(3) + together, grid%cells(3)) - 1
            do j = first(2), min(first(2) + together, grid%cells(2)) - 1
               do i = first(1), min(first(1) + together, grid%cells(1)) - 1
                  middle = grid%lower + ([i, j, k] + 0.5_wp)*grid%cell_size
                  if (abs(shape%distance(middle)) > sqrt(0.75_wp)*grid%cell_size) cycle
                  call find_surface(shape, middle, 0.5_wp*grid%cell_size, grid%lower, grid%upper, &
                                    grid%lower, grid%upper, area, surface, weighted)
               end do
            end do
         end do
      end do
   end function surface_of

end module m_fill_report
