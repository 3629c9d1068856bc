!> What the laws of plastic flow read from their group of a scene, and what they refuse.
program plastic_variables
   use m_kinds, only: wp
   use m_communicator, only: communicator_t
   use m_errors, only: error_t
   use m_namelist_text, only: namelist_text_t
   use m_group_reader, only: group_reader_t
   use m_plastic, only: plastic_t
   use m_j2, only: j2_t
   use m_johnson_cook, only: johnson_cook_t
   use m_assertions, only: assertions_t
   implicit none
   type(communicator_t) :: comm
   type(assertions_t) :: test
   call comm%start()
   call test%start(comm, 'plastic_variables')
   call reading()
   call test%finish()

contains

   !> The variables of the two laws' groups, and what is refused.
   subroutine reading()
      type(j2_t) :: j2
      type(johnson_cook_t) :: jc
      call read_group(j2, 'yield_stress=2e8, hardening_modulus=1e9', '')
      call test%check_close([j2%yield_stress, j2%hardening_modulus], [2.0e8_wp, 1.0e9_wp], 0.0_wp, 'j2: read')
      j2 = j2_t()
      call read_group(j2, 'hardening_strain=0,0.1, hardening_stress=1e8,3e8', '')
      call test%check_close([j2%yield_stress, j2%hardening_strain, j2%hardening_stress], &
                            [1.0e8_wp, 0.0_wp, 0.1_wp, 1.0e8_wp, 3.0e8_wp], 0.0_wp, 'j2: table read')
      call refused('hardening_modulus=1e9', 'yield_stress: missing; must be a number above 0 Pa')
      call refused('yield_stress=1e8, hardening_modulus=-1', 'must be at least 0 Pa')
      call refused('hardening_strain=0,0.1', 'hardening_stress: missing')
      call refused('hardening_strain=0,0.1, hardening_stress=1e8', &
                   'must have as many numbers as hardening_strain')
      call refused('hardening_strain=0.1,0.2, hardening_stress=1e8,2e8', 'must begin with 0')
      call refused('hardening_strain=0,0.2,0.2, hardening_stress=1e8,2e8,3e8', 'must rise')
      call refused('hardening_strain=0,0.2, hardening_stress=1e8,0.9e8', 'must not fall')
      call refused('hardening_strain=0,0.2, hardening_stress=0,1e8', 'must be above 0 Pa')
      call refused('hardening_strain=0,0.2, hardening_stress=1e8,2e8, yield_stress=2e8', &
                   'must be the first of hardening_stress')
      call refused('hardening_strain=0,0.2, hardening_stress=1e8,2e8, hardening_modulus=1', &
                   'must be 0 or absent')
      call read_group(jc, 'yield_stress=9e7, hardening_modulus=3e8, hardening_exponent=0.3, '// &
                      'rate_coefficient=0.02, '// &
                      'thermal_exponent=1.1, melting_temperature=1356, specific_heat=383, '// &
                      'room_temperature=300', '')
      call test%check_close([jc%yield_stress, jc%hardening_modulus, jc%hardening_exponent, &
                             jc%rate_coefficient, jc%reference_rate, jc%thermal_exponent, &
                             jc%room_temperature, jc%melting_temperature, jc%specific_heat, &
                             jc%heat_fraction], [9.0e7_wp, 3.0e8_wp, 0.3_wp, 0.02_wp, 1.0_wp, 1.1_wp, &
                                                 300.0_wp, 1356.0_wp, 383.0_wp, 0.9_wp], 0.0_wp, &
                                                 'Johnson-Cook: read')
      jc = johnson_cook_t()
      call read_group(jc, 'yield_stress=9e7, hardening_modulus=3e8, hardening_exponent=0.3, '// &
                      'rate_coefficient=0.02, '// &
                      'thermal_exponent=1.1, melting_temperature=290, specific_heat=383', &
                      'must be above room_temperature')
   end subroutine reading

   subroutine refused(variables, sentence)
      character(len=*), intent(in) :: variables, sentence
      type(j2_t) :: law
      call read_group(law, variables, sentence)
   end subroutine refused

   !> Read a law's variables; `sentence` is part of what must be said, nothing when it is empty.
   subroutine read_group(law, variables, sentence)
      class(plastic_t), intent(inout) :: law
      character(len=*), intent(in) :: variables, sentence
      type(namelist_text_t) :: text
      type(group_reader_t) :: group
      type(error_t) :: error
      call text%parse('&material young=1e9, poisson=0.3, '//variables//' /'//new_line('a'), error)
      call group%begin(text%groups(1))
      select type (law)
      type is (j2_t)
         call law%variables(group)
      type is (johnson_cook_t)
         call law%variables(group)
      end select
      call group%finish(error)
      if (sentence == '') then
         call test%check(.not. error%happened(), 'accepted: '//variables)
      else if (error%happened()) then
         call test%check(index(error%message, sentence) > 0, 'refused: '//variables, error%message)
      else
         call test%check(.false., 'refused: '//variables)
      end if
   end subroutine read_group

end program plastic_variables
