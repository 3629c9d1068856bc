!> The words for the choices of a scene, and the names of its groups. A choice is its word's index, except for
!> boundaries and criteria (their codes begin at 0).
module m_scene_words
   use m_domain_kinds, only: domain_kinds
   use m_side_kinds, only: side_kinds
   implicit none
   private

   character(len=*), parameter, public :: mode_words(2) = [character(len=4) :: 'run', 'plan']
   character(len=*), parameter, public :: boundary_words(size(side_kinds)) = side_kinds%name
   character(len=*), parameter, public :: stress_update_words(3) = [character(len=4) :: 'usl', 'usf', 'musl']
   character(len=*), parameter, public :: velocity_update_words(2) = [character(len=4) :: 'flip', 'pic']
   character(len=*), parameter, public :: static_mode_words(2) = [character(len=7) :: 'static', 'newmark']
   character(len=*), parameter, public :: preconditioner_words(3) = [character(len=6) :: 'jacobi', 'gamg', &
                                                                                       'bpx']
   character(len=*), parameter, public :: transfer_words(2) = [character(len=6) :: 'affine', 'plain']
   character(len=*), parameter, public :: domain_words(size(domain_kinds)) = domain_kinds%name
   character(len=*), parameter, public :: level_shape_words(2) = [character(len=6) :: 'box', 'sphere']
   character(len=*), parameter, public :: criterion_words(4) = [character(len=6) :: 'none', 'stress', &
                                                                 'strain', 'error']
   character(len=*), parameter, public :: start_words(2) = [character(len=5) :: 'apart', 'as_is']
   character(len=*), parameter, public :: fill_words(2) = [character(len=5) :: 'whole', 'share']
   character(len=*), parameter, public :: field_words(4) = [character(len=20) :: 'displacement', 'strain', &
      'deformation_gradient', 'none']

   character(len=*), parameter, public :: motion_words(2) = [character(len=5) :: 'slide', 'turn']

   !> Groups that are not effects; for each whether it is required and whether it may be repeated. Groups that
   !> others refer to by name (tools, materials, bodies) stand before these.
   character(len=*), parameter, public :: group_words(16) = [character(len=12) :: 'scene', 'grid', 'time', &
                                                             'material', 'body', 'cut', 'body_contact', &
                                                             'tool', 'motion', 'level', 'probe', 'contact', &
                                                             'quasi_static', 'guard', 'output', 'checkpoint']
   logical, parameter, public :: group_required(16) = [.true., .true., .false., .true., .true., .false., &
                                                       .false., .false., .false., .false., .false., .false., &
                                                       .false., .false., .false., .false.]
   logical, parameter, public :: group_repeats(16) = [.false., .false., .false., .true., .true., .true., &
                                                      .true., .true., .true., .true., .true., .false., &
                                                      .false., .false., .false., .false.]
end module m_scene_words
