!> Unsupported files that users bring: their kind, by their first bytes, and the advice for them.
module m_foreign_files
   use m_words, only: lower_case
   implicit none
   private
   public :: foreign_map, foreign_grains

   !> The first bytes of a kind of file, its name, and what is allowed instead.
   type :: kind_t
      character(len=32) :: begins = ''
      integer :: length = 0 !< of `begins`; includes zero bytes
      character(len=64) :: what = ''
      character(len=320) :: allowed = ''
   end type kind_t

   character(len=*), parameter :: gwyddion = 'saved by Gwyddion as .gwy or exported as text'
   character(len=*), parameter :: mesh = 'its surface as STL or OBJ, by meshio, trimesh, Gmsh or Blender'
   ! the cells of the most dimensions alone: files store the triangles of the surface beside the tetrahedra
   character(len=*), parameter :: skin = 'd = numpy.array([c.dimension for c in g.cell]); '// &
      'g.extract_cells(d == d.max()).extract_surface().triangulate().save(''a.stl'')"'
   character(len=*), parameter :: volume = 'its surface as STL: python -c "import numpy, pyvista; '// &
      'g = pyvista.read(''FILE''); '//skin
   character(len=*), parameter :: deck = 'its surface as STL: python -c "import meshio, numpy, pyvista; '// &
      'm = meshio.read(''FILE''); m.cell_sets = {}; g = pyvista.from_meshio(m); '//skin
   character(len=*), parameter :: gmsh = deck//'; of a model: gmsh -2 -format stl -o a.stl FILE'
   character(len=*), parameter :: partitioned = 'is a partitioned mesh of Gmsh (.msh); allowed: its '// &
      'surface as STL: python -c "import gmsh; gmsh.initialize(); gmsh.open(''FILE''); '// &
      'gmsh.model.mesh.unpartition(); gmsh.write(''a.stl'')"'
   character(len=*), parameter :: image = 'is image data of VTK; allowed: heights at one layer of '// &
      'points, as text: python -c "import numpy, pyvista; g = pyvista.read(''FILE''); '// &
      'numpy.savetxt(''a.txt'', g.active_scalars.reshape(g.dimensions[1::-1]))", with spacing in the scene'
   character(len=*), parameter :: maker = 'its surface as STL, by the program that made it or by Gmsh'
   character(len=*), parameter :: cad = 'its surface as STL, by Gmsh, FreeCAD or the program that made it'
   character(len=*), parameter :: zip = 'PK'//achar(3)//achar(4)

contains

   !> Message on a file given as surface or heights; empty: unknown kind.
   pure function foreign_map(bytes) result(fault)
      character(len=*), intent(in) :: bytes
      character(len=:), allocatable :: fault
      if (index(bytes, 'GWYP') == 1 .or. index(bytes, 'GWYO') == 1) then
         fault = 'is a file of Gwyddion (.gwy); make a map of it first: gimp3d-post heights FILE'
      else if (is_partitioned(bytes)) then
         fault = partitioned
      else if (is_image(bytes)) then
         fault = image
      else
         fault = sentence_of(bytes, [instruments(), microscopes(), models(), meshes(), decks()])
      end if
      if (fault == '' .and. is_iges(bytes)) fault = 'is a CAD model (IGES); allowed: '//cad
      if (fault == '' .and. is_universal(bytes)) &
         fault = 'is a universal file of I-DEAS (.unv); allowed: '//maker
   end function foreign_map

   !> Message on a file given as grains; empty: unknown kind.
   pure function foreign_grains(bytes) result(fault)
      character(len=*), intent(in) :: bytes
      character(len=:), allocatable :: fault
      character(len=min(len(bytes), 4096)) :: head
      character(len=*), parameter :: points = &
         ': a line for each point of a map. Allowed: a line a grain, its mean orientation, as MTEX '// &
         'gives it (orix: the mean of the equivalent orientations nearest to one of them); a file of DREAM.3D'
      fault = ''
      head = lower_case(bytes(:len(head)))
      if (index(head, '# tem_pixperum') > 0 .or. index(head, '# header: start') > 0 .or. &
          index(head, '# grid: sqrgrid') > 0 .or. index(head, '# grid: hexgrid') > 0) then
         fault = 'is a map of EBSD (.ang)'//points
      else if (index(head, 'channel text file') == 1) then
         fault = 'is a map of EBSD (.ctf)'//points
      else if (index(head, '<vtkfile') > 0 .or. index(head, '# vtk datafile') == 1) then
         fault = 'is a file of VTK; allowed: HDF5 with grain and orientations, a text, or a file of '// &
                 'DREAM.3D or Neper'
      else if (index(head, 'matlab 5.0') == 1) then
         fault = 'is a file of MATLAB; allowed: HDF5 by h5create and h5write, or a text of lines'
      else if (index(bytes, zip) == 1) then
         fault = 'is a zip archive; allowed: the file in it'
      end if
   end function foreign_grains

   pure function sentence_of(bytes, kinds) result(fault)
      character(len=*), intent(in) :: bytes
      type(kind_t), intent(in) :: kinds(:)
      character(len=:), allocatable :: fault
      integer :: n
      fault = ''
      do n = 1, size(kinds)
         if (len(bytes) < kinds(n)%length) cycle
         if (bytes(:kinds(n)%length) /= kinds(n)%begins(:kinds(n)%length)) cycle
         fault = 'is '//trim(kinds(n)%what)//'; allowed: '//trim(kinds(n)%allowed)
         return
      end do
   end function sentence_of

   pure type(kind_t) function kind_of(begins, what, allowed) result(kind)
      character(len=*), intent(in) :: begins, what, allowed
      kind%begins = begins
      kind%length = len(begins)
      kind%what = what
      kind%allowed = allowed
   end function kind_of

   !> Height formats of instruments, and standard formats.
   pure function instruments() result(kinds)
      type(kind_t), allocatable :: kinds(:)
      kinds = [kind_of('bISO-1.0', 'a surface data file (.sdf, ISO 25178-71)', gwyddion), &
               kind_of('aISO-1.0', 'a surface data file (.sdf, ISO 25178-71)', gwyddion), &
               kind_of('bISO-2.0', 'a surface data file (.sdf, ISO 25178-71)', gwyddion), &
               kind_of('aISO-2.0', 'a surface data file (.sdf, ISO 25178-71)', gwyddion), &
               kind_of('DIGITAL SURF', 'a file of Digital Surf (.sur, .pro)', gwyddion), &
               kind_of('DSCOMPRESSED', 'a file of Digital Surf (.sur, .pro)', gwyddion), &
               kind_of(achar(136)//achar(27)//achar(3)//'o', 'a file of Zygo (.dat)', gwyddion), &
               kind_of(achar(136)//achar(27)//achar(3)//'p', 'a file of Zygo (.dat)', gwyddion), &
               kind_of(achar(136)//achar(27)//achar(3)//'q', 'a file of Zygo (.dat)', gwyddion), &
               kind_of('VK4_', 'a file of Keyence (.vk4)', gwyddion), &
               kind_of('VK6', 'a file of Keyence (.vk6)', gwyddion), &
               kind_of(achar(1)//achar(0)//'Directory', 'a file of Wyko or Bruker (.opd)', gwyddion), &
               kind_of('AliconaImaging', 'a file of Alicona (.al3d)', gwyddion)]
   end function instruments

   !> Heights of probe microscopes and of mapping programs, texts in other encodings, pictures.
   pure function microscopes() result(kinds)
      type(kind_t), allocatable :: kinds(:)
      character(len=*), parameter :: picture = 'heights, STL or OBJ. Export the heights as text'
      kinds = [kind_of('Gwyddion Simple Field', 'a simple field of Gwyddion (.gsf)', gwyddion), &
               kind_of('\*File list', 'a file of a NanoScope', gwyddion), &
               kind_of('\*Force file list', 'a file of a NanoScope', gwyddion), &
               kind_of('[DataSet]', 'a file of Nanosurf (.nid)', gwyddion), &
               kind_of(achar(176)//achar(1)//achar(147)//achar(255), 'a file of NT-MDT', gwyddion), &
               kind_of('DSBB', 'a binary grid of Surfer', 'saved as ASCII (DSAA)'), &
               kind_of('DSRB', 'a binary grid of Surfer', 'saved as ASCII (DSAA)'), &
               kind_of(achar(255)//achar(254), 'a text in UTF-16', 'saved as UTF-8 or ASCII'), &
               kind_of(achar(254)//achar(255), 'a text in UTF-16', 'saved as UTF-8 or ASCII'), &
               kind_of('II*'//achar(0), 'an image (TIFF)', picture), &
               kind_of('MM'//achar(0)//'*', 'an image (TIFF)', picture), &
               kind_of(achar(137)//'PNG', 'an image (PNG)', picture), &
               kind_of(achar(255)//achar(216)//achar(255), 'an image (JPEG)', picture), &
               kind_of(achar(147)//'NUMPY', 'an array of NumPy (.npy)', 'a text by np.savetxt, or HDF5'), &
               kind_of('MATLAB 5.0', 'a file of MATLAB', 'its heights as text, or HDF5 with height'), &
               kind_of('SFLZ', 'a file of surfalize (.sflz)', 'its heights as text, or HDF5 with height'), &
               kind_of(zip, 'a zip archive (.x3p, .plux, .3mf, .FCStd, ...)', &
                       'heights saved by Gwyddion as .gwy, a body as STL or OBJ')]
   end function microscopes

   !> CAD models and drawings.
   pure function models() result(kinds)
      type(kind_t), allocatable :: kinds(:)
      kinds = [kind_of('glTF', 'a glTF file', mesh), &
               kind_of('BLENDER', 'a file of Blender', mesh), &
               kind_of('#VRML', 'a VRML file', mesh), &
               kind_of('Kaydara FBX', 'an FBX file', mesh), &
               kind_of('#usda', 'a USD file', mesh), kind_of('PXR-USDC', 'a USD file', mesh), &
               kind_of('ISO-10303-21', 'a CAD model (STEP)', cad), &
               kind_of('DBRep_DrawableShape', 'a CAD model (BRep)', cad), &
               kind_of('CASCADE Topology', 'a CAD model (BRep)', cad), &
               kind_of('**ABCDEFGHIJKLMNOPQR', 'a CAD model (Parasolid)', cad), &
               kind_of('3D Geometry File Format', 'a CAD model (Rhino)', cad), &
               kind_of('AC10', 'a drawing (DWG)', cad), &
               kind_of('AutoCAD Binary DXF', 'a drawing (DXF)', cad), &
               kind_of('  0'//new_line('a')//'SECTION', 'a drawing (DXF)', cad), &
               kind_of('0'//new_line('a')//'SECTION', 'a drawing (DXF)', cad), &
               kind_of('  0'//achar(13)//new_line('a')//'SECTION', 'a drawing (DXF)', cad), &
               kind_of(achar(208)//achar(207)//achar(17)//achar(224), &
                       'a file of SolidWorks, Inventor or an old Office', cad)]
   end function models

   !> Surfaces and meshes.
   pure function meshes() result(kinds)
      type(kind_t), allocatable :: kinds(:)
      kinds = [kind_of('ply', 'a PLY file', mesh), &
               kind_of('$MeshFormat', 'a mesh of Gmsh (.msh)', gmsh), &
               kind_of('$NOD', 'a mesh of Gmsh (.msh)', gmsh), &
               kind_of('(0 ', 'a mesh of Fluent (.msh, .cas)', maker), &
               kind_of('(1 ', 'a mesh of Fluent (.msh, .cas)', maker), &
               kind_of('(2 ', 'a mesh of Fluent (.msh, .cas)', maker), &
               kind_of('OFF', 'an OFF file', mesh), &
               kind_of('# vtk DataFile', 'a file of VTK', volume), &
               kind_of('<?xml', 'an XML file (VTK, AMF, X3D, ...)', mesh), &
               kind_of('<VTKFile', 'a file of VTK', volume), &
               kind_of('MeshVersionFormatted', 'a mesh of Medit', deck), &
               kind_of(' MeshVersionFormatted', 'a mesh of Medit', deck), &
               kind_of('mesh3d', 'a mesh of Netgen (.vol)', deck), &
               kind_of('# Created by COMSOL Multiphysics', 'a mesh of COMSOL (.mphtxt)', &
                       'its surface as STL, by COMSOL''s export'), &
               kind_of('CDF', 'a NetCDF file (Exodus, GMT)', &
                       'a mesh''s surface as STL by PyVista, heights as text, or as HDF5 with height'), &
               kind_of('FoamFile', 'a mesh of OpenFOAM', 'its surface as STL, by surfaceMeshExtract'), &
               kind_of('TITLE', 'a file of Tecplot', deck), kind_of('#!TDV', 'a file of Tecplot', deck)]
   end function meshes

   !> Input decks of finite-element programs.
   pure function decks() result(kinds)
      type(kind_t), allocatable :: kinds(:)
      kinds = [kind_of('*KEYWORD', 'a deck of LS-DYNA', maker), &
               kind_of('*keyword', 'a deck of LS-DYNA', maker), &
               kind_of('$#', 'a deck of LS-DYNA', maker), &
               kind_of('*HEADING', 'a deck of Abaqus', deck), &
               kind_of('*Heading', 'a deck of Abaqus', deck), &
               kind_of('*NODE', 'a deck of Abaqus or CalculiX', deck), &
               kind_of('*Node', 'a deck of Abaqus or CalculiX', deck), &
               kind_of('**', 'a deck of Abaqus or CalculiX', deck), &
               kind_of('BEGIN BULK', 'a deck of Nastran', deck), &
               kind_of('SOL ', 'a deck of Nastran', deck), &
               kind_of('CEND', 'a deck of Nastran', deck), kind_of('GRID', 'a deck of Nastran', deck), &
               kind_of('$', 'a deck of Nastran or LS-DYNA', maker), &
               kind_of('/COM', 'a deck of ANSYS (.cdb)', maker), &
               kind_of('/PREP7', 'a deck of ANSYS (.cdb)', maker), &
               kind_of('/BATCH', 'a deck of ANSYS (.cdb)', maker)]
   end function decks

   pure logical function is_partitioned(bytes)
      character(len=*), intent(in) :: bytes
      is_partitioned = index(bytes(:min(len(bytes), 11)), '$MeshFormat') == 1
      if (is_partitioned) is_partitioned = index(bytes, '$PartitionedEntities') > 0
   end function is_partitioned

   !> VTK's data on a regular grid of points, legacy or XML.
   pure logical function is_image(bytes)
      character(len=*), intent(in) :: bytes
      character(len=min(len(bytes), 1024)) :: head
      head = bytes(:len(head))
      if (index(head, '# vtk DataFile') == 1) then
         is_image = index(head, 'STRUCTURED_POINTS') > 0
      else
         is_image = index(head, '<VTKFile') > 0 .and. index(head, '<ImageData') > 0
      end if
   end function is_image

   !> IGES: the 73rd column of its first line is S.
   pure logical function is_iges(bytes)
      character(len=*), intent(in) :: bytes
      is_iges = .false.
      if (len(bytes) > 81) is_iges = bytes(73:73) == 'S' .and. bytes(79:80) /= '  ' .and. bytes(80:80) == '1'
   end function is_iges

   !> A universal file begins with a line of -1 and a line with only the number of a dataset.
   pure logical function is_universal(bytes)
      character(len=*), intent(in) :: bytes
      character(len=4), parameter :: datasets(7) = ['151 ', '164 ', '2411', '2412', '2420', '15  ', '781 ']
      integer :: first, second
      is_universal = .false.
      first = scan(bytes(:min(len(bytes), 90)), new_line('a'))
      if (first < 3) return
      if (plain(bytes(:first - 1)) /= '-1') return
      second = scan(bytes(first + 1:min(len(bytes), first + 90)), new_line('a'))
      if (second > 1) is_universal = any(plain(bytes(first + 1:first + second - 1)) == datasets)
   contains
      pure function plain(line)
         character(len=*), intent(in) :: line
         character(len=:), allocatable :: plain
         plain = trim(adjustl(line(:scan(line//achar(13), achar(13)) - 1)))
      end function plain
   end function is_universal

end module m_foreign_files
