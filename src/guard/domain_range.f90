!> Checks whether a run leaves the range of validity of its choice of domains (theory.md, Range of domains):
!> warns once, and ends a run whose body has separated numerically.
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
      integer(i8), allocatable, private :: extent(:, :) !< (3, bodies): sites of their lattices along each
                                                        !< axis
      integer(i8), private :: checked = 0                !< step of the last check
      character(len=:), allocatable :: said             !< the first warning
      logical, private :: reported(5) = .false. !< warnings given: tension, gaps, overlap, loads on a
                                            !< lagging stress, stretched cubes
   contains
      procedure :: start
      procedure :: check
   end type domain_range_t

   integer, parameter :: check_every = 400               !< steps
   real(wp), parameter :: max_tension = 0.01_wp !< of the plane-wave modulus: tension limit of boxes that fill
                                                !< a cell
   real(wp), parameter :: apart = 0.2_wp !< cells: neighbours further apart than their strains give by this
                                         !< are separated,
   real(wp), parameter :: hardly_stretched = 1.15_wp !< up to this stretch; beyond, where shear and rotation
                                                     !< contribute:
   real(wp), parameter :: apart_strained = 0.5_wp       !< cells
   real(wp), parameter :: max_pressed = 0.2_wp !< compressive strain up to which cubes are valid; beyond they
                                               !< overlap
   real(wp), parameter :: max_pairs_drawn = 0.25_wp !< tensile strain up to which cubes are valid; beyond they
                                                    !< leave gaps,
   real(wp), parameter :: max_drawn_mean = 0.1_wp  !< and where strain rates are means over cells

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

   !> Collective: every `look_every` steps, or if `now`. `message`: a new warning, empty if none.
   subroutine check(self, model, now, message, error)
      class(domain_range_t), intent(inout) :: self
      type(model_t), intent(in) :: model
      logical, intent(in) :: now
      character(len=:), allocatable, intent(out) :: message
      type(error_t), intent(inout) :: error
      real(wp) :: worst(4)
      integer :: b
      logical :: means !< an effect replaces strain rates by means over cells
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

   !> Update the worst values: the tension of particles that fill a cell, over the modulus; for fixed domains
   !> the longest stretched edge, in cells, and the largest compressive and tensile strains of edges; an error
   !> where neighbours have separated.
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
               if (.not. stretch < huge(stretch)) exit ! no field gives it
               if (tension > 0.0_wp .and. .not. whole) & ! these have a limit of their own, on tension
                  worst(2) = max(worst(2), stretch*2.0_wp*values(level%layout%half_size)*level%grid%per_cell)
               worst(3) = max(worst(3), 1.0_wp - stretch)
               if (tension > 0.0_wp) worst(4) = max(worst(4), stretch - 1.0_wp)
            end do
         end do
      end associate
      if (n > 1) call find_gaps(self, model, b, listed(:n), error)
   end subroutine check_block

   !> Find particles that touched at the start, are in one block still, and are further apart than their
   !> strains give.
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

   !> An error where two neighbours have separated.
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

   !> Stretch of a particle along a direction, as given by its fields; huge if no field gives it.
   real(wp) function stretch_along(model, values, body, direction) result(stretch)
      type(model_t), intent(in) :: model
      real(wp), intent(in) :: values(:)    !< the particle's columns
      integer, intent(in) :: body          !< its body
      real(wp), intent(in) :: direction(3) !< unit vector
      associate (law => model%materials%slots(model%materials%of_body(body))%law)
         stretch = law%stretch(values, model%levels(1)%layout, direction)
      end associate
   end function stretch_along

   !> Index of a number in a rising list; 0 if absent.
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
