!> The JSON Schema of a scene, for editors: made by the same calls that read it. A scene as JSON is an object
!> of its groups; groups that may be repeated are an object or a list of them.
module m_scene_schema
   use m_constants, only: program_version
   use m_group_reader, only: group_reader_t, name_length
   use m_offer, only: catalogue_t, offer_t
   use m_scene, only: scene_t
   use m_scene_groups, only: describe_group
   use m_scene_words, only: group_words, group_required, group_repeats
   use m_schema_text, only: json_text
   implicit none
   private
   public :: scene_schema

   character(len=*), parameter :: newline = new_line('a')

contains

   function scene_schema(catalogue) result(text)
      type(catalogue_t), intent(in) :: catalogue
      character(len=:), allocatable :: text
      type(group_reader_t) :: group
      type(scene_t) :: scene
      class(offer_t), allocatable :: effect
      character(len=name_length) :: material_names(0)
      integer :: kind
      allocate (scene%materials(1), scene%bodies(1), scene%tools(1), scene%levels(1), scene%probes(1))
      allocate (scene%body_contacts(1), scene%cuts(1))
      text = '{"$schema":"https://json-schema.org/draft/2020-12/schema",'//newline// &
             '"title":'//json_text('scene of gimp3d '//program_version)//',"type":"object",'// &
             '"additionalProperties":false,"required":['//required_groups()//'],'//newline//'"properties":{'
      do kind = 1, size(group_words)
         call group%begin_schema()
         call describe_group(trim(group_words(kind)), group, 1, material_names, catalogue, scene)
         if (kind > 1) text = text//','
         text = text//newline//entry_of(trim(group_words(kind)), group, group_repeats(kind))
      end do
      do kind = 1, size(catalogue%effects)
         call group%begin_schema()
         allocate (effect, source=catalogue%effects(kind)%it)
         call effect%variables(group)
         text = text//','//newline//entry_of(effect%name, group, effect%repeats)
         deallocate (effect)
      end do
      text = text//newline//'}}'
   end function scene_schema

   function entry_of(name, group, repeats) result(text)
      character(len=*), intent(in) :: name
      type(group_reader_t), intent(in) :: group
      logical, intent(in) :: repeats
      character(len=:), allocatable :: text
      text = group%schema_text()
      if (repeats) text = '{"anyOf":['//text//',{"type":"array","items":'//text//'}]}'
      text = json_text(name)//':'//text
   end function entry_of

   function required_groups() result(text)
      character(len=:), allocatable :: text
      integer :: kind
      text = ''
      do kind = 1, size(group_words)
         if (.not. group_required(kind)) cycle
         if (text /= '') text = text//','
         text = text//json_text(trim(group_words(kind)))
      end do
   end function required_groups

end module m_scene_schema
