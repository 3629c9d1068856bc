!> The list of the formats of snapshots: one line a format.
module m_snapshot_formats
   use m_group_reader, only: name_length
   use m_offer, only: catalogue_t
   use m_snapshot_format, only: snapshot_format_t
   implicit none
   private
   public :: known_formats, choose_formats

   type, public :: format_slot_t
      character(len=name_length) :: name = ''
      class(snapshot_format_t), allocatable :: it
   end type format_slot_t

contains

   !> All formats, the default first. One line a format, with its own `use`.
   subroutine list(formats)
      type(format_slot_t), allocatable, intent(out) :: formats(:)
      allocate (formats(0))
      block; use m_hdf5_snapshot, only: hdf5_snapshot_t; call add('hdf5', hdf5_snapshot_t()); end block
      block; use m_tecplot_snapshot, only: tecplot_snapshot_t; call add('tecplot', tecplot_snapshot_t())
      end block
   contains
      subroutine add(name, it)
         character(len=*), intent(in) :: name
         class(snapshot_format_t), intent(in) :: it
         type(format_slot_t), allocatable :: more(:)
         integer :: f
         allocate (more(size(formats) + 1))
         do f = 1, size(formats)
            more(f)%name = formats(f)%name
            call move_alloc(formats(f)%it, more(f)%it)
         end do
         more(f)%name = name
         allocate (more(f)%it, source=it)
         call move_alloc(more, formats)
      end subroutine add
   end subroutine list

   !> Add their names to a catalogue.
   subroutine known_formats(catalogue)
      type(catalogue_t), intent(inout) :: catalogue
      type(format_slot_t), allocatable :: formats(:)
      call list(formats)
      catalogue%formats = formats%name
   end subroutine known_formats

   !> The formats named in a scene.
   subroutine choose_formats(names, chosen)
      character(len=*), intent(in) :: names(:)
      type(format_slot_t), allocatable, intent(out) :: chosen(:)
      type(format_slot_t), allocatable :: formats(:)
      integer :: c, f
      call list(formats)
      allocate (chosen(size(names)))
      c = 0
      do f = 1, size(formats)
         if (.not. any(names == formats(f)%name)) cycle
         c = c + 1
         chosen(c)%name = formats(f)%name
         call move_alloc(formats(f)%it, chosen(c)%it)
      end do
   end subroutine choose_formats

end module m_snapshot_formats
