!> The procedure of a user's law in its shared library, the names that it is called with, and the data of a
!> call.
module m_user_library
   use, intrinsic :: iso_c_binding, only: c_char, c_funptr
   use m_kinds, only: wp
   use m_checksum, only: text_checksum
   use m_dynamic_library, only: find_procedure, library_of
   use m_filesystem, only: read_file, never_ends
   use m_group_reader, only: group_reader_t
   implicit none
   private
   public :: find_law, law_name, name_size, points_t, room_for, place_tensor, tensor_place, matrix_place

   integer, parameter :: longest_library = 1000000000 !< bytes
   integer, parameter :: name_size = 80 !< characters of CMNAME, the material's name in Abaqus's subroutines

   !> Input and output of a call, for n particles. Tensors are xx yy zz xy yz xz (shear is that of the tensor,
   !> half the engineering one), matrices 11 22 33 12 23 31 21 32 13; all are in the corotational frame except
   !> `deformation`, or all in that of the grid. Old: at the beginning of the step.
   type :: points_t
      integer :: count = 0
      real(wp) :: time = 0.0_wp, time_step = 0.0_wp !< time at the step's end, s
      real(wp), allocatable :: place(:, :)          !< (n, 3), m
      real(wp), allocatable :: size(:)              !< cube root of the volume, m
      real(wp), allocatable :: density(:)           !< at mid-step, kg/m3
      real(wp), allocatable :: strain(:, :)         !< (n, 6) increment
      real(wp), allocatable :: spin(:, :)           !< (n, 3) rotation of the material relative to the frame
      real(wp), allocatable :: total(:, :)          !< (n, 6) sum of the earlier strains, rotated along
      real(wp), allocatable :: stretch_old(:, :), stretch(:, :)         !< (n, 6), U of F = R U
      real(wp), allocatable :: deformation_old(:, :), deformation(:, :) !< (n, 9), F
      real(wp), allocatable :: stress_old(:, :), stress(:, :)           !< (n, 6), Pa
      real(wp), allocatable :: state_old(:, :), state(:, :) !< (n, states); `state` has some more columns,
                                                            !< which a law must not change
      real(wp), allocatable :: energy_old(:), energy(:)   !< per mass: work of the stress, J/kg
      real(wp), allocatable :: inelastic_old(:), inelastic(:) !< dissipated part of it, J/kg
      real(wp), allocatable :: share(:)             !< below 1: the step that the law requests, as a share of
                                                    !< this one
      real(wp), allocatable :: moduli(:, :)         !< (n, 36) d stress/d strain, column by column, for a law
                                                    !< that gives them, in its own order, Pa
   end type points_t

   !> Indices of xx yy zz yz xz xy among xx yy zz xy yz xz, and of 11 21 31 12 22 32 13 23 33 among the
   !> matrices.
   integer, parameter :: tensor_place(6) = [1, 2, 3, 5, 6, 4], matrix_place(9) = [1, 7, 6, 4, 2, 8, 9, 5, 3]

contains

   !> Find the law's procedure in its library, by the symbol name of compilers; an error if it is missing, or
   !> the library's checksum differs.
   subroutine find_law(library, checksum, group, name, source, what, address, found)
      character(len=*), intent(in) :: library
      character(len=:), allocatable, intent(inout) :: checksum !< of the file; empty: not known yet
      type(group_reader_t), intent(inout) :: group
      character(len=*), intent(in) :: name, source !< `vumat_`; the source file of libraries: `mylaw.f`
      character(len=*), intent(in) :: what         !< expected contents: `SUBROUTINE VUMAT`
      type(c_funptr), intent(out) :: address
      logical, intent(out) :: found
      character(len=:), allocatable :: complaint, allowed
      logical :: opened
      found = .false.
      if (never_ends(library)) then
         call group%refuse('library', 'is a pipe or a device; allowed: a file on the disk')
         return
      end if
      call find_procedure(library, name, address, opened, complaint)
      found = complaint == ''
      if (found) then
         call check_library(library_of(address), checksum, group, found)
         return
      end if
      allowed = 'allowed: a library made by `make vumat FILE='//source//'`'
      if (opened) then
         call group%refuse('library', 'has no '//name//'; '//allowed//', of a file with a '//what)
      else
         call group%refuse('library', 'cannot be opened ('//complaint//'); '//allowed)
      end if
   end subroutine find_law

   !> Check that the library is the one that the scene was made with, if the scene has a checksum.
   subroutine check_library(path, checksum, group, good)
      character(len=*), intent(in) :: path
      character(len=:), allocatable, intent(inout) :: checksum
      type(group_reader_t), intent(inout) :: group
      logical, intent(inout) :: good
      character(len=:), allocatable :: bytes, digits
      call read_file(path, longest_library, bytes, good)
      if (.not. good) then
         call group%refuse('library', 'cannot be read')
         return
      end if
      digits = text_checksum(bytes)
      good = checksum == '' .or. checksum == digits
      if (.not. good) call group%refuse('library', 'has been changed: its checksum is '//digits// &
                                        ', the scene was made with '//checksum)
      checksum = digits
   end subroutine check_library

   !> The name of a material for Abaqus's subroutines, in capitals.
   pure function law_name(label) result(name)
      character(len=*), intent(in) :: label
      character(kind=c_char) :: name(name_size)
      integer :: i
      name = ' '
      do i = 1, min(len(label), name_size)
         name(i) = label(i:i)
         if (llt('`', name(i)) .and. llt(name(i), '{')) name(i) = achar(iachar(name(i)) - 32)
      end do
   end function law_name

   !> Allocate data of n particles.
   pure type(points_t) function room_for(n, states, moduli, spare) result(points)
      integer, intent(in) :: n, states
      integer, intent(in) :: spare !< columns after the states
      logical, intent(in) :: moduli !< also the data for a law in the frame of the grid
      points%count = n
      allocate (points%place(n, 3), points%size(n), points%density(n), points%strain(n, 6), &
                points%spin(n, 3), points%stretch_old(n, 6), points%stretch(n, 6), &
                points%deformation_old(n, 9), points%deformation(n, 9), points%stress_old(n, 6), &
                points%stress(n, 6), points%state_old(n, states), points%state(n, states + spare), &
                points%energy_old(n), points%energy(n), points%inelastic_old(n), points%inelastic(n), &
                source=0.0_wp)
      if (.not. moduli) return
      allocate (points%share(n), source=1.0_wp)
      allocate (points%total(n, 6), points%moduli(n, 36), source=0.0_wp)
   end function room_for

   !> xx yy zz yz xz xy in the order of a call.
   pure subroutine place_tensor(n, tensor, there)
      integer, intent(in) :: n
      real(wp), intent(in) :: tensor(n, 6)
      real(wp), intent(out) :: there(n, 6)
      integer :: c
      do c = 1, 6
         there(:, tensor_place(c)) = tensor(:, c)
      end do
   end subroutine place_tensor

end module m_user_library
