!> The head of a tool's history: its columns, and the facts that evaluations of an indentation need.
module m_tool_header
   use m_kinds, only: wp
   use m_first_surface, only: find_first_surface
   use m_history, only: history_header_t, history_text_length
   use m_scene, only: scene_t
   use m_side_kinds, only: side_kinds
   use m_text, only: exact_text, to_text
   implicit none
   private
   public :: tool_header

   real(wp), parameter :: rounding = 1.0e-3_wp !< of a cell

contains

   function tool_header(scene, n) result(header)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: n
      type(history_header_t) :: header
      integer :: body
      real(wp) :: gap
      header%title = scene%title
      header%zone = 'tool '//scene%tools(n)%name
      header%columns = [character(len=history_text_length) :: 'time [s]', 'depth [m]', 'load_x [N]', &
                        'load_y [N]', 'load_z [N]', 'contact_area [m2]', 'max_gap_violation [m]', &
                        'position_x [m]', 'position_y [m]', 'position_z [m]', 'rotation_w [1]', &
                        'rotation_x [1]', 'rotation_y [1]', 'rotation_z [1]', 'velocity_x [m/s]', &
                        'velocity_y [m/s]', 'velocity_z [m/s]', 'spin_x [rad/s]', 'spin_y [rad/s]', &
                        'spin_z [rad/s]', 'moment_x [N m]', 'moment_y [N m]', 'moment_z [N m]', &
                        'max_deflection [m]']
      call find_first_surface(scene, n, body, gap)
      header%notes = [character(len=history_text_length) :: 'model_share='//to_text(model_share(scene, n)), &
                      'indented_body='//to_text(body), 'surface_gap='//exact_text(gap)]
   end function tool_header

   !> The modelled share of the tool: one half for each symmetry plane that contains its axis; of a tool from
   !> a file, for each that is parallel to its axis and that it meets at the start.
   pure real(wp) function model_share(scene, n) result(share)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: n
      integer :: axis, side
      real(wp) :: plane
      share = 1.0_wp
      associate (grid => scene%grid, tool => scene%tools(n))
         if (grid%section%is_round()) return
         do axis = 1, 3
            if (grid%section%is_flat() .and. axis == 2) cycle
            do side = 1, 2
               plane = merge(grid%lower(axis), grid%upper(axis), side == 1)
               if (side_kinds(grid%boundary(2*axis - 2 + side))%mirrors &
                   .and. abs(tool%axis(axis)) < 1.0e-9_wp &
                   .and. meets(axis, plane)) share = 0.5_wp*share
            end do
         end do
      end associate
   contains
      !> The tip of a file is any point of it; sizes in a file may be rounded.
      pure logical function meets(axis, plane)
         integer, intent(in) :: axis
         real(wp), intent(in) :: plane !< m
         real(wp) :: lower(3), upper(3)
         associate (tool => scene%tools(n), cell => scene%grid%cell_size)
            meets = abs(tool%tip(axis) - plane) < 1.0e-9_wp*cell
            if (.not. tool%shape%is_searched()) return
            call tool%shape%bounding_box(lower, upper)
            meets = tool%tip(axis) + lower(axis) < plane + rounding*cell &
                    .and. tool%tip(axis) + upper(axis) > plane - rounding*cell
         end associate
      end function meets
   end function model_share

end module m_tool_header
