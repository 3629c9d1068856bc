!> Words of other programs, and of the field, for names in a scene; and units of numbers.
module m_synonyms
   use m_kinds, only: wp
   implicit none
   private
   public :: meant, factor_of

   integer, parameter :: width = 24

   !> A word, its candidates here (the first of these that is allowed is suggested), and a hint.
   type :: synonym_t
      character(len=width) :: word
      character(len=width) :: meant(3) = ''
      character(len=96) :: hint = ''
      logical :: alone = .false. !< the hint alone is the answer, where `meant` is allowed
   end type synonym_t

contains

   !> Suggestion for a word that is not allowed, as `meant: pyramid (with faces=4)`; empty: unknown.
   pure function meant(word, allowed) result(text)
      character(len=*), intent(in) :: word       !< in lower case
      character(len=*), intent(in) :: allowed(:)
      character(len=:), allocatable :: text
      type(synonym_t), allocatable :: list(:)
      integer :: n, k
      text = ''
      list = [groups(), groups_of_programs(), laws_and_shapes(), shapes_of_tips(), variables(), &
              variables_of_bodies(), variables_of_tools()]
      do n = 1, size(list)
         if (list(n)%word /= squeezed(word)) cycle
         do k = 1, size(list(n)%meant)
            if (list(n)%meant(k) == '' .or. .not. any(allowed == list(n)%meant(k))) cycle
            text = 'meant: '//trim(list(n)%meant(k))
            if (list(n)%hint /= '') text = text//' ('//trim(list(n)%hint)//')'
            if (list(n)%alone) text = trim(list(n)%hint)
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

   !> A word without an equivalent; the hint on what to do instead applies where the word `beside` is allowed.
   pure function none(word, beside, hint) result(synonym)
      character(len=*), intent(in) :: word, beside, hint
      type(synonym_t) :: synonym
      synonym = synonym_t(word, [character(len=width) :: beside, '', ''], hint, .true.)
   end function none

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

   !> Groups, commands and blocks of LAMMPS, Abaqus, CalculiX, MOOSE and Karamelo.
   pure function groups_of_programs() result(list)
      type(synonym_t), allocatable :: list(:)
      character(len=*), parameter :: law = 'a variable of it, or its model', &
                                     surface = 'with shape=''surface'', file=', &
                                     sides = 'with boundary=, a word for each of the six sides', &
                                     times = 'times and values at them stand in the group they belong to', &
                                     rows = 'one for each place; rows at history_every of &output'
      list = [one('region', 'body', hint='or &level'), one('create', 'body'), one('lattice', 'grains'), &
              one('object', 'body'), one('objects', 'body'), one('particles', 'body'), &
              one('group', 'body', hint='with contact_group= for contact between bodies'), &
              one('import', 'body', hint=surface), one('stl', 'body', hint=surface), &
              one('elastic', 'material', hint=law), one('plastic', 'material', hint=law), &
              one('density', 'material', hint=law), one('eos', 'material', hint=law), &
              one('strength', 'material', hint=law), one('hyperelastic', 'material', hint=law), &
              one('materials', 'material'), &
              one('usermaterial', 'material', hint='with model=''vumat'' or ''umat'''), &
              one('depvar', 'material', hint='with states='), &
              one('subroutine', 'material', hint='with model=''vumat'', library='), &
              one('run', 'scene', hint='with end_time=, s'), one('executioner', 'time'), &
              one('dynamic', 'time'), one('explicit', 'time'), one('massscaling', 'quasi_static'), &
              one('boundary', 'grid', hint=sides), one('bc', 'grid', hint=sides), &
              one('bcs', 'grid', hint=sides), one('symmetry', 'grid', hint=sides), one('box', 'grid'), &
              one('simulationbox', 'grid'), &
              none('fix', 'tool', 'see &tool, &motion, &pressure, &gravity, or boundary= of &grid'), &
              none('amplitude', 'tool', times), none('function', 'tool', times), &
              none('functions', 'tool', times), &
              none('units', 'tool', 'all numbers are in SI: m, s, kg, N, Pa, K'), &
              none('nlgeom', 'tool', 'large strains are always followed'), &
              none('variables', 'tool', 'fields are chosen by fields= of &output'), &
              none('kernels', 'tool', 'the equations of motion are always solved'), &
              one('initialconditions', 'body', hint='with velocity=, stress='), &
              one('ics', 'body', hint='with velocity='), one('surface', 'tool', 'body', hint=surface), &
              one('cload', 'pressure', hint='on an area, Pa'), one('bload', 'gravity'), &
              one('friction', 'tool', hint='with friction='), one('surfaceinteraction', 'body_contact'), &
              one('contactproperty', 'body_contact'), one('toolpath', 'motion'), &
              one('velocity', 'body', hint='with velocity='), one('adaptive', 'level'), &
              one('adaptivity', 'level', hint='with criterion='), one('viscosity', 'bulk_viscosity'), &
              one('dump', 'output'), one('outputs', 'output'), &
              one('thermo', 'output', hint='with history_every='), one('nodefile', 'output'), &
              one('elfile', 'output'), one('plot', 'output'), one('print', 'probe', hint=rows), &
              one('elprint', 'probe', hint=rows), one('nodeprint', 'probe', hint=rows), &
              one('monitor', 'probe', hint=rows), one('sensor', 'probe', hint=rows), &
              one('gauge', 'probe', hint=rows), one('tracer', 'probe', hint=rows), &
              one('postprocessors', 'probe', hint=rows)]
   end function groups_of_programs

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

   pure function shapes_of_tips() result(list)
      type(synonym_t), allocatable :: list(:)
      character(len=*), parameter :: round = 'with tip_radius='
      list = [one('spheroconical', 'cone', hint=round), one('conospherical', 'cone', hint=round), &
              one('roundedcone', 'cone', hint=round), &
              one('rockwell', 'cone', hint='with half_angle=60, tip_radius=200e-6'), &
              one('brinell', 'sphere'), one('cylindrical', 'flat', hint='with radius=, its end presses'), &
              one('roller', 'cylinder'), one('pin', 'sphere', 'flat'), one('platen', 'flat'), &
              one('plate', 'flat', 'box'), one('halfspace', 'flat'), one('rectangle', 'box'), &
              one('slab', 'box'), one('film', 'box'), one('layer', 'box'), &
              one('ellipsoid', 'surface', hint='as an STL or OBJ file'), &
              one('torus', 'surface', hint='as an STL or OBJ file'), &
              one('paraboloid', 'sphere', hint='near its tip a paraboloid is a sphere'), &
              one('mesh', 'surface', 'file'), &
              one('tube', 'cylinder', hint='and a &cut, or inner_radius in a section'), &
              one('hollowcylinder', 'cylinder', hint='and a &cut'), &
              one('ring', 'cylinder', hint='and a &cut'), one('plasticity', 'j2'), &
              one('perfectlyplastic', 'j2'), one('steel', 'j2'), one('metal', 'j2'), one('ludwik', 'j2'), &
              one('swift', 'j2'), one('ludwig', 'j2'), one('rambergosgood', 'j2'), &
              one('perzyna', 'norton'), one('nortonhoff', 'norton'), one('kelvinvoigt', 'maxwell'), &
              one('stvk', 'elastic'), one('saintvenant', 'elastic'), one('corotated', 'neo_hookean'), &
              one('mooneyrivlin', 'neo_hookean', hint='other hyperelastic laws: vumat or umat'), &
              one('ogden', 'neo_hookean', hint='other hyperelastic laws: vumat or umat'), &
              one('jelly', 'neo_hookean'), one('fluid', 'mie_grueneisen'), one('water', 'mie_grueneisen'), &
              none('rigid', 'elastic', 'rigid things are tools: &tool')]
   end function shapes_of_tips

   pure function variables_of_bodies() result(list)
      type(synonym_t), allocatable :: list(:)
      character(len=*), parameter :: lame = 'E = mu (3 lambda + 2 mu)/(lambda + mu)', &
                                     moduli = 'E = 9 K G/(3 K + G), nu = E/(2 G) - 1', &
                                     section = '''plane_strain'' or ''axisymmetric''', &
                                     cells = 'edge of the cubes, m', &
                                     steps = 's; steps are as long as is stable (&time)', &
                                     corners = 'lower and upper are corners'
      list = [one('steps', 'end_time', hint=steps), one('nsteps', 'end_time', hint=steps), &
              one('numsteps', 'end_time', hint=steps), one('maxsteps', 'end_time', hint=steps), &
              one('run', 'end_time', hint=steps), one('duration', 'end_time'), &
              one('timeperiod', 'end_time'), one('totaltime', 'end_time'), one('dtfactor', 'safety'), &
              one('dtmult', 'safety'), one('dimension', 'geometry', hint=section), &
              one('dim', 'geometry', hint=section), one('planestrain', 'geometry', hint=section), &
              one('axisymmetric', 'geometry', hint=section), one('nx', 'cell_size', hint=cells), &
              one('n', 'cell_size', 'hardening_exponent', hint=''), one('ngrid', 'cell_size', hint=cells), &
              one('resolution', 'cell_size', hint=cells), one('res', 'cell_size', hint=cells), &
              one('elements', 'cell_size', hint=cells), one('spacing', 'cell_size', hint=cells), &
              one('gridsize', 'cell_size', hint=cells), one('extents', 'upper', hint=corners), &
              one('origin', 'lower', 'center', hint=''), one('length', 'upper', 'height', hint=corners), &
              one('width', 'upper', hint=corners), one('height', 'upper', hint=corners), &
              one('min', 'lower'), one('max', 'upper'), &
              one('periodic', 'boundary', hint='there are no periodic sides; symmetry is one'), &
              none('gravity', 'boundary', 'a group of its own: &gravity acceleration='), &
              one('lambda', 'young', hint=lame), one('lame', 'young', hint=lame), &
              one('mu', 'young', hint=lame), one('bulk', 'young', hint=moduli), &
              one('bulkmodulus', 'young', hint=moduli), one('shearmodulus', 'young', hint=moduli), &
              one('k', 'young', hint=moduli), one('g', 'young', hint=moduli), &
              one('type', 'model', 'shape', 'kind'), one('law', 'model'), &
              one('props', 'constants', 'model', hint='those of user laws'), &
              one('depvar', 'states', 'model', hint='states= of user laws'), &
              one('nstatv', 'states', 'model', hint='states= of user laws'), &
              one('nstatev', 'states', 'model', hint='states= of user laws'), &
              one('nparticles', 'particles_per_cell'), one('particles', 'particles_per_cell'), &
              one('group', 'contact_group'), one('initialvelocity', 'velocity', 'initial_speed'), &
              none('fixed', 'particles_per_cell', &
                   'bodies are held by boundary= of &grid where they touch its sides'), &
              none('filename', 'shape', 'file=, with shape=''surface''')]
   end function variables_of_bodies

   pure function variables_of_tools() result(list)
      type(synonym_t), allocatable :: list(:)
      character(len=*), parameter :: depth = 'over times: the depth is their integral', &
                                     back = 'below 0 to go back, 0 to stay, over times', &
                                     speed = 'along the axis of the tool, m/s, with times'
      list = [one('maxdepth', 'speeds', hint=depth), one('penetration', 'speeds', hint=depth), &
              one('indentationdepth', 'speeds', hint=depth), one('rate', 'speeds', hint=speed), &
              one('indentationspeed', 'speeds', hint=speed), &
              one('loadingrate', 'loads', hint='N, with times'), &
              one('maxload', 'loads', hint='N, with times'), &
              one('peakload', 'loads', hint='N, with times'), one('strainrate', 'speeds', hint=speed), &
              one('hold', 'speeds', hint=back), one('holdtime', 'speeds', hint=back), &
              one('unload', 'speeds', hint=back), one('unloading', 'speeds', hint=back), &
              one('rounding', 'tip_radius'), one('bluntness', 'tip_radius'), &
              one('noseradius', 'tip_radius', 'radius'), one('apexradius', 'tip_radius', 'radius'), &
              one('orientation', 'rotation', 'axis'), one('coefficientoffriction', 'friction'), &
              one('frictional', 'friction'), &
              none('stiffness', 'speeds', 'tools are rigid; one that gives is a body'), &
              none('material', 'speeds', 'tools are rigid; one that gives is a body'), &
              one('variables', 'fields'), one('variable', 'fields'), one('quantities', 'fields'), &
              one('dump', 'every'), one('dt', 'every'), one('timestep', 'every'), &
              one('outputinterval', 'every'), one('timeinterval', 'every'), one('dumpevery', 'every'), &
              one('format', 'formats'), one('prefix', 'directory'), one('name', 'directory'), &
              one('basename', 'directory'), one('filename', 'directory')]
   end function variables_of_tools

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

   !> A unit in SI; 0: not a unit.
   pure real(wp) function factor_of(unit)
      character(len=*), intent(in) :: unit
      select case (unit)
      case ('m', 's', 'N', 'Pa', 'kg', 'J', 'K', 'm/s', 'kg/m3', 'kg/m^3'); factor_of = 1.0_wp
      case ('deg', 'degrees'); factor_of = 1.0_wp
      case ('GPa', 'GHz', 'gpa'); factor_of = 1.0e9_wp
      case ('MPa', 'MN', 'mpa', 'N/mm2', 'N/mm^2'); factor_of = 1.0e6_wp
      case ('kPa', 'kN', 'km', 'kpa', 'g/cm3', 'g/cm^3'); factor_of = 1.0e3_wp
      case ('mm', 'ms', 'mN', 'g'); factor_of = 1.0e-3_wp
      case ('um', 'us', 'uN', 'mum', 'micron'); factor_of = 1.0e-6_wp
      case ('nm', 'ns', 'nN'); factor_of = 1.0e-9_wp
      case ('ps', 'pm'); factor_of = 1.0e-12_wp
      case ('psi'); factor_of = 6894.757_wp
      case ('ksi'); factor_of = 6.894757e6_wp
      case ('Msi'); factor_of = 6.894757e9_wp
      case default; factor_of = 0.0_wp
      end select
   end function factor_of

end module m_synonyms
