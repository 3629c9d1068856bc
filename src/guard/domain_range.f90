!> Watches whether a run leaves the range in which its choice of domains is right (theory.md, Range of
!> domains): says so once, and ends a run whose body has come apart.
module m_domain_range
   use mpi_f08
   use m_kinds, only: wp, i8
   use m_constants, only: exit_numerical
   use m_errors, only: error_t, fail
   use m_text, only: to_text
   use m_sorting, only: sorted_order
   use m_domain_kinds, only: domain_kinds
   use m_scene, only: scene_t, update_usl
   use m_body, only: first_id, lattice_extent
   use m_split, only: is_whole, largest_tension
   use m_model, only: model_t
   use m_complaints, only: particle_text
   implicit none
   private
   public :: domain_range_t

   type :: domain_range_t
      integer(i8), allocatable, private :: extent(:, :) !< (3, bodies): places of their lattices
      integer(i8), private :: checked = 0                !< step of the last check
      character(len=:), allocatable :: said             !< the first sentence
      logical, private :: reported(5) = .false. !< of tension, of gaps, of overlap, of loads on a stress that
                                            !< lags, of cubes that are drawn out
   contains
      procedure :: start
      procedure :: check
   end type domain_range_t

   integer, parameter :: check_every = 400               !< steps
   real(wp), parameter :: max_tension = 0.01_wp !< of the modulus of a wave, that boxes of one a cell are to
                                                 !< bear
   real(wp), parameter :: apart = 0.2_wp !< neighbours so many cells further apart than their strains say are
                                         !< torn,
   real(wp), parameter :: hardly_stretched = 1.15_wp !< up to this stretch; beyond, where shear and turning
                                                     !< count too:
   real(wp), parameter :: apart_strained = 0.5_wp       !< cells
   real(wp), parameter :: max_pressed = 0.2_wp !< strain to which cubes may be pressed; then they overlap
   real(wp), parameter :: max_pairs_drawn = 0.25_wp !< strain to which cubes may be drawn out; then they leave
                                               !< gaps,
   real(wp), parameter :: max_drawn_mean = 0.1_wp  !< and with strain rates that are means of cells

contains

   subroutine start(self, scene)
      class(domain_range_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      integer :: b
      self%said = ''
      allocate (self%extent(3, size(scene%bodies)))
      do b = 1, size(scene%bodies)
         self%extent(:, b) = lattice_extent(scene%bodies(b), scene%grid%cell_size)
      end do
   end subroutine start

   !> Collective: every so many steps, and where `now` says so. `news`: what is to be said now, empty if
   !> nothing.
   subroutine check(self, model, now, message, error)
      class(domain_range_t), intent(inout) :: self
      type(model_t), intent(in) :: model
      logical, intent(in) :: now
      character(len=:), allocatable, intent(out) :: message
      type(error_t), intent(inout) :: error
      real(wp) :: worst(4)
      integer :: b
      logical :: means !< an effect makes strain rates means of cells
      message = ''
      if (.not. (now .or. model%step - self%checked >= check_every)) return
      self%checked = model%step
      worst = 0.0_wp
      do b = 1, size(model%levels(1)%blocks)
         call check_block(self, model, b, worst, error)
      end do
      call model%communicator%agree(error)
      call MPI_Allreduce(MPI_IN_PLACE, worst, size(worst), MPI_DOUBLE_PRECISION, MPI_MAX, &
                         model%communicator%comm)
      if (error%happened()) return
      means = size(model%effect_step(1)%on_cells) > 0
      if (model%method%stress_update /= update_usl .and. size(model%effect_step(1)%add_forces) > 0 &
          .and. .not. self%reported(4)) then
         self%reported(4) = .true.
         message = 'range      stress_update=''usf'' or ''musl'' with loads on faces: the stress '// &
                'is wrong where a face is near a '// &
                'plane of nodes, and the face drifts; errors of some per cent; use ''usl'''
      else if (worst(1) > max_tension .and. .not. self%reported(1)) then
         self%reported(1) = .true.
         message = 'range      particles that are all of a cell bear a tension of '//to_text(worst(1), 2)// &
                ' of their modulus: '// &
                'fixed domains of one a cell separate (numerical fracture); use particles_per_cell=8 or '// &
                'domain=''corners'''
      else if (worst(2) > 1.0_wp .and. .not. self%reported(2)) then
         self%reported(2) = .true.
         message = 'range      particles are stretched to '//to_text(worst(2), 3)// &
                ' cells: fixed domains separate above 1 '// &
                '(numerical fracture); use domain=''stretch'' or ''corners'''
      else if (worst(3) > max_pressed .and. .not. self%reported(3)) then
         self%reported(3) = .true.
         message = 'range      particles are compressed by '//to_text(100.0_wp*worst(3), 2)// &
                ' %: fixed domains overlap, '// &
                'errors of some per cent in loads and stresses; use domain=''stretch'' or ''corners'''
      else if (worst(4) > merge(max_drawn_mean, max_pairs_drawn, means) .and. .not. self%reported(5)) then
         self%reported(5) = .true.
         message = 'range      particles are stretched by '//to_text(100.0_wp*worst(4), 2)// &
                ' %: fixed domains '// &
                'leave gaps'//trim(merge(', which &anti_locking widens', '                            ', &
                                         means))// &
                '; errors of some per cent in lengths and stresses, and soon large ones; use '// &
                'domain=''stretch'' or ''corners'''
      end if
      if (self%said == '') self%said = message
   end subroutine check

   !> The largest tension of particles that are all of a cell, over the modulus; of fixed domains the longest
   !> stretched edge, in cells, the largest share that is pressed away of one and that it is drawn out by; a
   !> fault where neighbours have come apart.
   subroutine check_block(self, model, b, worst, error)
      type(domain_range_t), intent(in) :: self
      type(model_t), intent(in) :: model
      integer, intent(in) :: b
      real(wp), intent(inout) :: worst(4)
      type(error_t), intent(inout) :: error
      integer :: listed(model%levels(1)%blocks(b)%particles%count), axis, n, p
      real(wp) :: values(model%levels(1)%table%columns), tension, stretch, direction(3)
      logical :: whole
      n = 0
      associate (level => model%levels(1), particles => model%levels(1)%blocks(b)%particles, &
                 domain => domain_kinds(model%method%domain))
         do p = 1, particles%count
            whole = is_whole(particles%column(p, :), level%layout, level%grid%cell, &
                             model%stuff(particles%body(p)))
            if (whole) then
               n = n + 1
               listed(n) = p
            end if
            if (domain%turns .or. .not. (whole .or. .not. domain%deforms)) cycle
            values = particles%column(p, :)
            tension = largest_tension(values, level%layout, 0.0_wp)
            if (whole) worst(1) = max(worst(1), tension/model%stuff(particles%body(p))%modulus)
            if (domain%deforms) cycle
            do axis = 1, 3
               direction = 0.0_wp
               direction(axis) = 1.0_wp
               stretch = stretch_along(model, values, particles%body(p), direction)
               if (.not. stretch < huge(stretch)) exit ! nothing tells it
               if (tension > 0.0_wp .and. .not. whole) & ! those have a bar of their own, of tension
                  worst(2) = max(worst(2), stretch*2.0_wp*values(level%layout%half_size)*level%grid%per_cell)
               worst(3) = max(worst(3), 1.0_wp - stretch)
               if (tension > 0.0_wp) worst(4) = max(worst(4), stretch - 1.0_wp)
            end do
         end do
      end associate
      if (n > 1) call find_gaps(self, model, b, listed(:n), error)
   end subroutine check_block

   !> Particles that touched each other at the start, in one block still, and are further apart than their
   !> strains say.
   subroutine find_gaps(self, model, b, listed, error)
      type(domain_range_t), intent(in) :: self
      type(model_t), intent(in) :: model
      integer, intent(in) :: b, listed(:)
      type(error_t), intent(inout) :: error
      integer :: order(size(listed)), axis, body, m, other
      integer(i8) :: id(size(listed)), place, step(3)
      associate (particles => model%levels(1)%blocks(b)%particles)
         id = particles%id(listed)
         order = sorted_order(id, id)
         id = id(order)
         do m = 1, size(listed)
            if (id(m) >= 2_i8**model%levels(1)%layout%id_bits) cycle
            body = particles%body(listed(order(m)))
            place = id(m) - first_id(body, model%levels(1)%layout) - 1
            step = [1_i8, self%extent(1, body), self%extent(1, body)*self%extent(2, body)]
            do axis = 1, 3
               if (mod(place/step(axis), self%extent(axis, body)) == self%extent(axis, body) - 1) cycle
               other = place_of(id, id(m) + step(axis))
               if (other > 0) call compare(model, b, listed(order(m)), listed(order(other)), error)
            end do
         end do
      end associate
   end subroutine find_gaps

   !> A fault where two neighbours are apart.
   subroutine compare(model, b, p, q, error)
      type(model_t), intent(in) :: model
      integer, intent(in) :: b, p, q
      type(error_t), intent(inout) :: error
      real(wp) :: way(3), far, near
      associate (level => model%levels(1), particles => model%levels(1)%blocks(b)%particles, &
                 x => model%levels(1)%layout%position)
         way = particles%column(q, x:x + 2) - particles%column(p, x:x + 2)
         far = norm2(way)
         if (far <= (1.0_wp + apart)*level%grid%cell) return
         near = 0.5_wp*level%grid%cell*(stretch_along(model, particles%column(p, :), particles%body(p), &
                                                      way/far) &
                                       + stretch_along(model, particles%column(q, :), particles%body(q), &
                                                       way/far))
         if (.not. far - near > level%grid%cell*merge(apart, apart_strained, &
                                                      near <= hardly_stretched*level%grid%cell)) return
         call fail(error, exit_numerical, particle_text(model, 1, b, p)//' and its neighbour '// &
                   to_text(particles%id(q))//' are '//to_text(far*level%grid%per_cell, 3)// &
                   ' cells apart, where their strains say '//to_text(near*level%grid%per_cell, 3)// &
                   ': the body has separated (numerical fracture); use '// &
                   'particles_per_cell=8 or domain=''corners''')
      end associate
   end subroutine compare

   !> How much longer a particle has become along a direction, as far as its fields tell; huge where they do
   !> not.
   real(wp) function stretch_along(model, values, body, direction) result(stretch)
      type(model_t), intent(in) :: model
      real(wp), intent(in) :: values(:)    !< the particle's columns
      integer, intent(in) :: body          !< its body
      real(wp), intent(in) :: direction(3) !< unit vector
      associate (law => model%materials%slots(model%materials%of_body(body))%law)
         stretch = law%stretch(values, model%levels(1)%layout, direction)
      end associate
   end function stretch_along

   !> Where a number stands in a rising list; 0: nowhere.
   pure integer function place_of(list, number) result(place)
      integer(i8), intent(in) :: list(:), number
      integer :: low, high
      low = 1
      high = size(list)
      do while (low < high)
         place = (low + high)/2
         if (list(place) < number) then
            low = place + 1
         else
            high = place
         end if
      end do
      place = merge(low, 0, list(low) == number)
   end function place_of

end module m_domain_range
