!> Words of other programs, and of the field, for what a scene calls otherwise; and units of numbers.
module m_synonyms
   use m_kinds, only: wp
   implicit none
   private
   public :: meant, factor_of

   integer, parameter :: width = 24

   !> A word, what it may be here (the first of these that is allowed), and what to know about it.
   type :: synonym_t
      character(len=width) :: word
      character(len=width) :: meant(3) = ''
      character(len=72) :: hint = ''
   end type synonym_t

contains

   !> What a word that is not allowed may stand for, as `pyramid (with faces=4, half_angle=68)`; empty:
   !> nothing known.
   pure function meant(word, allowed) result(text)
      character(len=*), intent(in) :: word       !< in lower case
      character(len=*), intent(in) :: allowed(:)
      character(len=:), allocatable :: text
      type(synonym_t), allocatable :: list(:)
      integer :: n, k
      text = ''
      list = [groups(), laws_and_shapes(), variables()]
      do n = 1, size(list)
         if (list(n)%word /= squeezed(word)) cycle
         do k = 1, size(list(n)%meant)
            if (list(n)%meant(k) == '' .or. .not. any(allowed == list(n)%meant(k))) cycle
            text = trim(list(n)%meant(k))
            if (list(n)%hint /= '') text = text//' ('//trim(list(n)%hint)//')'
            return
         end do
      end do
   end function meant

   !> Without _ and -.
   pure function squeezed(word) result(text)
      character(len=*), intent(in) :: word
      character(len=:), allocatable :: text
      integer :: i
      text = ''
      do i = 1, len_trim(word)
         if (scan(word(i:i), '_- ') == 0) text = text//word(i:i)
      end do
   end function squeezed

   pure function one(word, first, second, third, hint) result(synonym)
      character(len=*), intent(in) :: word, first
      character(len=*), intent(in), optional :: second, third, hint
      type(synonym_t) :: synonym
      synonym%word = word
      synonym%meant(1) = first
      if (present(second)) synonym%meant(2) = second
      if (present(third)) synonym%meant(3) = third
      if (present(hint)) synonym%hint = hint
   end function one

   pure function groups() result(list)
      type(synonym_t), allocatable :: list(:)
      list = [one('indenter', 'tool'), one('punch', 'tool', 'flat'), one('die', 'tool'), &
              one('tip', 'tool'), one('rigid', 'tool'), one('rigidbody', 'tool'), one('part', 'body'), &
              one('specimen', 'body'), one('sample', 'body'), one('solid', 'body'), &
              one('workpiece', 'body'), one('geometry', 'body'), one('mesh', 'grid', 'surface', 'file'), &
              one('domain', 'grid'), one('background', 'grid'), one('analysis', 'scene'), &
              one('simulation', 'scene'), one('job', 'scene'), one('general', 'scene'), &
              one('step', 'time', 'quasi_static'), one('solver', 'quasi_static', 'time'), &
              one('static', 'quasi_static'), one('implicit', 'quasi_static'), &
              one('newmark', 'quasi_static', hint='with mode=''newmark'''), &
              one('interaction', 'body_contact'), one('contactpair', 'body_contact'), &
              one('load', 'pressure', 'loads'), one('dload', 'pressure'), &
              one('traction', 'pressure', hint='with traction=tx,ty,tz'), one('bodyforce', 'gravity'), &
              one('restart', 'checkpoint'), one('results', 'output'), one('history', 'output'), &
              one('field', 'output'), one('refinement', 'level'), one('amr', 'level'), &
              one('polycrystal', 'grains'), one('texture', 'grains'), one('hole', 'cut'), &
              one('void', 'cut'), one('fracture', 'damage'), one('hourglass', 'anti_locking'), &
              one('fbar', 'anti_locking'), one('bbar', 'anti_locking')]
   end function groups

   pure function laws_and_shapes() result(list)
      type(synonym_t), allocatable :: list(:)
      character(len=*), parameter :: vickers = 'with faces=4, half_angle=68'
      list = [one('vonmises', 'j2'), one('mises', 'j2'), one('plastic', 'j2'), one('elastoplastic', 'j2'), &
              one('elasticplastic', 'j2'), one('bilinear', 'j2'), one('isotropichardening', 'j2'), &
              one('linearhardening', 'j2'), one('chaboche', 'j2'), one('j2plasticity', 'j2'), &
              one('johnsoncook', 'johnson_cook'), one('jc', 'johnson_cook'), one('linear', 'elastic'), &
              one('linearelastic', 'elastic'), one('hooke', 'elastic'), one('isotropic', 'elastic'), &
              one('neohookean', 'neo_hookean'), one('neohooke', 'neo_hookean'), &
              one('hyperelastic', 'neo_hookean'), one('rubber', 'neo_hookean'), &
              one('viscoelastic', 'maxwell'), one('prony', 'maxwell'), one('zener', 'maxwell'), &
              one('creep', 'norton'), one('viscoplastic', 'norton'), one('powerlaw', 'norton', 'j2'), &
              one('eos', 'mie_grueneisen'), one('gruneisen', 'mie_grueneisen'), &
              one('crystalplasticity', 'crystal'), one('druckerprager', 'drucker_prager'), &
              one('mohrcoulomb', 'drucker_prager'), one('soil', 'drucker_prager'), &
              one('sand', 'drucker_prager'), one('user', 'vumat', 'umat'), &
              one('vickers', 'pyramid', hint=vickers), &
              one('knoop', 'surface', hint='as an STL file: its diagonals differ'), &
              one('cubecorner', 'berkovich', hint='with half_angle=35.26'), one('conical', 'cone'), &
              one('spherical', 'sphere'), one('ball', 'sphere'), one('brick', 'box'), one('cube', 'box'), &
              one('block', 'box', 'body'), one('cuboid', 'box'), one('plate', 'box'), &
              one('rod', 'cylinder'), one('disk', 'cylinder'), one('flatpunch', 'flat'), &
              one('plane', 'flat'), one('wall', 'flat'), one('knife', 'wedge'), &
              one('stl', 'surface', 'file'), one('obj', 'surface'), one('heightmap', 'surface'), &
              one('afm', 'surface')]
   end function laws_and_shapes

   pure function variables() result(list)
      type(synonym_t), allocatable :: list(:)
      character(len=*), parameter :: speed = 'along the axis of the tool, m/s, with times', &
                                     depth = 'over times: the depth is their integral', &
                                     angle = 'between the axis and the surface'
      list = [one('e', 'young'), one('youngs', 'young'), one('youngsmodulus', 'young'), &
              one('elasticmodulus', 'young'), one('modulus', 'young'), one('emod', 'young'), &
              one('nu', 'poisson'), one('poissonsratio', 'poisson'), one('poissonratio', 'poisson'), &
              one('rho', 'density'), one('massdensity', 'density'), one('sigmay', 'yield_stress'), &
              one('sigy', 'yield_stress'), one('yield', 'yield_stress'), &
              one('yieldstrength', 'yield_stress'), one('sy', 'yield_stress'), &
              one('hardening', 'hardening_modulus'), &
              one('tangentmodulus', 'hardening_modulus', hint='H = E Et/(E - Et) of a tangent modulus Et'), &
              one('velocity', 'speeds', hint=speed), one('speed', 'speeds', 'velocity', hint=speed), &
              one('v', 'velocity', 'speeds'), one('depth', 'speeds', hint=depth), &
              one('displacement', 'speeds', hint=depth), &
              one('angle', 'half_angle', 'rotation', hint=angle), &
              one('semiangle', 'half_angle', hint=angle), one('coneangle', 'half_angle', hint=angle), &
              one('apexangle', 'half_angle', hint=angle), &
              one('includedangle', 'half_angle', hint='half of it'), &
              one('force', 'loads', hint='N, with times'), one('mu', 'friction'), one('cof', 'friction'), &
              one('frictioncoefficient', 'friction'), one('coefficient', 'friction'), &
              one('dt', 'time_step'), one('timestep', 'time_step'), one('courant', 'safety'), &
              one('cflnumber', 'safety'), one('tend', 'end_time'), one('endtime', 'end_time'), &
              one('tmax', 'end_time'), one('time', 'end_time'), &
              one('h', 'cell_size', 'hardening_modulus'), one('dx', 'cell_size'), &
              one('meshsize', 'cell_size'), one('elementsize', 'cell_size'), one('cell', 'cell_size'), &
              one('ppc', 'particles_per_cell'), one('bc', 'boundary'), one('boundaries', 'boundary'), &
              one('position', 'tip', 'center', 'lower'), one('location', 'tip', 'center'), &
              one('centre', 'center'), one('direction', 'axis'), one('mat', 'material'), &
              one('dir', 'directory'), one('path', 'directory', 'file'), one('folder', 'directory'), &
              one('interval', 'every'), one('frequency', 'every'), one('dumpinterval', 'every'), &
              one('r', 'radius'), one('diameter', 'radius', hint='half of it'), &
              one('size', 'upper', hint='lower and upper are corners'), one('g', 'acceleration'), &
              one('filename', 'file'), one('units', 'scale'), one('unit', 'scale'), &
              one('euler', 'orientation', 'orientations'), &
              one('eulerangles', 'orientation', 'orientations'), one('pressure', 'values')]
   end function variables

   !> A unit in SI; 0: no unit.
   pure real(wp) function factor_of(unit)
      character(len=*), intent(in) :: unit
      select case (unit)
      case ('m', 's', 'N', 'Pa', 'kg', 'J', 'K', 'm/s', 'kg/m3', 'kg/m^3'); factor_of = 1.0_wp
      case ('GPa', 'GHz', 'gpa'); factor_of = 1.0e9_wp
      case ('MPa', 'MN', 'mpa', 'N/mm2', 'N/mm^2'); factor_of = 1.0e6_wp
      case ('kPa', 'kN', 'km', 'kpa', 'g/cm3', 'g/cm^3'); factor_of = 1.0e3_wp
      case ('mm', 'ms', 'mN', 'g'); factor_of = 1.0e-3_wp
      case ('um', 'us', 'uN', 'mum', 'micron'); factor_of = 1.0e-6_wp
      case ('nm', 'ns', 'nN'); factor_of = 1.0e-9_wp
      case ('ps', 'pm'); factor_of = 1.0e-12_wp
      case default; factor_of = 0.0_wp
      end select
   end function factor_of

end module m_synonyms
