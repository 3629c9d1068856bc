!test: ranks 1
!> Numbers as text: exact expectations.
program text
   use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan, ieee_positive_inf
   use m_kinds, only: wp, i8
   use m_text, only: to_text, exact_text, in_column, si, duration
   use m_communicator, only: communicator_t
   use m_assertions, only: assertions_t
   implicit none
   type(communicator_t) :: comm
   type(assertions_t) :: test
   call comm%start()
   call test%start(comm, 'text')
   call numbers()
   call with_prefix()
   call spans()
   call test%finish()

contains

   subroutine numbers()
      call same(to_text(5), '5')
      call same(to_text(-123456789012_i8), '-123456789012')
      call same(to_text(0.33_wp), '0.33')
      call same(to_text(0.0_wp), '0')
      call same(to_text(-2710.0_wp), '-2710')
      call same(to_text(1.5e-9_wp), '1.5e-9')
      call same(to_text(0.0001_wp), '0.0001')
      call same(to_text(0.00001_wp), '1e-5')
      call same(to_text(123456.0_wp), '123456')
      call same(to_text(999999.7_wp), '1e6')
      call same(to_text(1234567.0_wp), '1.23457e6')
      call same(to_text(0.1_wp, 17), '0.10000000000000001')
      call same(to_text(2.0_wp/3.0_wp, 2), '0.67')
      call same(exact_text(1.25e-11_wp), '1.25e-11')
      call same(exact_text(2.0_wp/3.0_wp), '0.6666666666666666')
      call same(exact_text(0.1_wp + 0.2_wp), '0.30000000000000004')
      call same(to_text(1.0e300_wp), '1e300')
      call same(to_text(-1.0e-300_wp), '-1e-300')
      call same(to_text(ieee_value(1.0_wp, ieee_quiet_nan)), 'NaN')
      call same(to_text(-ieee_value(1.0_wp, ieee_positive_inf)), '-Infinity')
      call same(in_column(371.0741_wp, 11, 3), '    371.074')
      call same(in_column(-0.5_wp, 11, 2), '      -0.50')
      call same(in_column(1234567.1234_wp, 11, 3), '      1.2e6') ! a blank before it is no longer there
      call same(in_column(9.87654e10_wp, 11, 2), '     9.9e10')
      call same(in_column(ieee_value(1.0_wp, ieee_quiet_nan), 11, 2), '        NaN')
   end subroutine numbers

   subroutine with_prefix()
      call same(si(1.034e-12_wp, 's'), '1.034 ps')
      call same(si(64.0e-9_wp, 'm'), '64 nm')
      call same(si(70.0e9_wp, 'Pa'), '70 GPa')
      call same(si(999.96_wp, 'Pa'), '1 kPa')
      call same(si(0.0_wp, 's'), '0 s')
      call same(si(-3.2e-3_wp, 'N'), '-3.2 mN')
      call same(si(12.5_wp, 's'), '12.5 s')
      call same(si(1.0e-22_wp, 's'), '1e-22 s')
      call same(si(ieee_value(1.0_wp, ieee_quiet_nan), 's'), 'NaN s')
   end subroutine with_prefix

   subroutine spans()
      call same(duration(0.002_wp), '2 ms')
      call same(duration(0.354_wp), '0.35 s')
      call same(duration(13.24_wp), '13.2 s')
      call same(duration(59.96_wp), '1 min 00 s')
      call same(duration(133.0_wp), '2 min 13 s')
      call same(duration(3599.7_wp), '1 h 00 min')
      call same(duration(11100.0_wp), '3 h 05 min')
      call same(duration(86399.0_wp), '1 d 00 h')
      call same(duration(183600.0_wp), '2 d 03 h')
      call same(duration(ieee_value(1.0_wp, ieee_positive_inf)), 'unknown')
   end subroutine spans

   subroutine same(got, expected)
      character(len=*), intent(in) :: got, expected
      call test%check(got == expected .and. len(got) == len(expected), expected, 'is `'//got//'`')
   end subroutine same

end program text
