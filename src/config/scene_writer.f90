!> A scene as a namelist that reads back to the same values: every value used, defaults included.
module m_scene_writer
   use m_group_reader, only: group_reader_t, name_length
   use m_offer, only: catalogue_t, offer
   use m_carved, only: uncarve
   use m_scene, only: scene_t
   use m_scene_groups, only: describe_group
   use m_scene_motion, only: motions_of
   use m_scene_words, only: group_words
   implicit none
   private
   public :: scene_as_namelist, physics_as_namelist

contains

   !> The part that must not change when a run is continued: all but &scene, &guard, &output and &checkpoint.
   function physics_as_namelist(scene) result(text)
      type(scene_t), intent(in) :: scene
      character(len=:), allocatable :: text
      text = scene_as_namelist(scene, left_out=[character(len=10) :: 'scene', 'guard', 'output', &
                               'checkpoint'])
   end function physics_as_namelist

   !> The whole scene, lines ended by new_line, without the groups `left_out`.
   function scene_as_namelist(scene, left_out) result(text)
      type(scene_t), intent(in) :: scene
      character(len=*), intent(in), optional :: left_out(:)
      character(len=:), allocatable :: text
      type(scene_t) :: copy
      type(catalogue_t) :: laws
      type(group_reader_t) :: group
      character(len=name_length) :: material_names(size(scene%materials))
      integer :: kind, number
      copy = scene
      do number = 1, size(copy%bodies)
         call uncarve(copy%bodies(number)%shape)
      end do
      do number = 1, size(scene%materials)
         material_names(number) = scene%materials(number)%name
         call offer(laws%models, scene%materials(number)%law%name, scene%materials(number)%law)
      end do
      laws%formats = [character(len=name_length) ::]
      if (allocated(scene%output%formats)) laws%formats = scene%output%formats
      text = ''
      do kind = 1, size(group_words)
         if (present(left_out)) then
            if (any(left_out == group_words(kind))) cycle
         end if
         do number = 1, groups_of(scene, trim(group_words(kind)))
            call group%begin_text(trim(group_words(kind)))
            call describe_group(trim(group_words(kind)), group, number, material_names, laws, copy)
            text = text//group%text()
         end do
      end do
      do number = 1, size(copy%effects)
         call group%begin_text(copy%effects(number)%it%name)
         call copy%effects(number)%it%variables(group)
         text = text//group%text()
      end do
   end function scene_as_namelist

   !> Number of groups of a kind to write.
   pure integer function groups_of(scene, kind) result(count)
      type(scene_t), intent(in) :: scene
      character(len=*), intent(in) :: kind
      select case (kind)
      case ('material'); count = size(scene%materials)
      case ('body'); count = size(scene%bodies)
      case ('tool'); count = size(scene%tools)
      case ('motion'); count = motions_of(scene%tools)
      case ('level')
         count = 0 ! a scene that was not read may have none
         if (allocated(scene%levels)) count = size(scene%levels)
      case ('cut')
         count = 0
         if (allocated(scene%cuts)) count = size(scene%cuts)
      case ('body_contact')
         count = 0
         if (allocated(scene%body_contacts)) count = size(scene%body_contacts)
      case ('probe'); count = size(scene%probes)
      case ('quasi_static'); count = merge(1, 0, scene%quasi_static%present)
      case ('output'); count = merge(1, 0, scene%output%present)
      case ('checkpoint'); count = merge(1, 0, scene%checkpoint%present)
      case default; count = 1
      end select
   end function groups_of

end module m_scene_writer
