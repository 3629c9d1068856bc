c     What laws call of Abaqus's utility routines. A law that brings one of the same name has its own.
c
c     The end of the analysis: the program says in a sentence whose law has ended it.
      subroutine xit
      call exit(1)
      end

      subroutine xplb_exit
      call exit(1)
      end

c     A message: lop 1 information, -1 warning, -2 error, -3 error that ends the analysis. %I, %R and %S stand for values.
      subroutine stdb_abqerr(lop, text, intv, realv, charv)
      integer lop, intv(*)
      double precision realv(*)
      character*(*) text, charv(*)
      call tell_law(lop, text, intv, realv)
      if (lop .eq. -3) call exit(1)
      end

      subroutine xplb_abqerr(lop, text, intv, realv, charv)
      integer lop, intv(*)
      double precision realv(*)
      character*(*) text, charv(*)
      call tell_law(lop, text, intv, realv)
      if (lop .eq. -3) call exit(1)
      end

      subroutine tell_law(lop, text, intv, realv)
      integer lop, intv(*), i, ni, nr
      double precision realv(*)
      character*(*) text
      write (0, '(2a)') 'the law says: ', text
      ni = 0
      nr = 0
      do i = 1, len(text) - 1
         if (text(i:i + 1) .eq. '%I') then
            ni = ni + 1
            write (0, '(a, i12)') '   ', intv(ni)
         else if (text(i:i + 1) .eq. '%R') then
            nr = nr + 1
            write (0, '(a, 1pe15.7)') '   ', realv(nr)
         end if
      end do
      end

c     The rank, as laws ask for it to write files of their own: they should not, and all are rank 0 here.
      subroutine getrank(krank)
      integer krank
      krank = 0
      end

      subroutine vgetrank(krank)
      integer krank
      krank = 0
      end

c     Mean stress and von Mises stress of 11 22 33 12 13 23.
      subroutine sinv(stress, sinv1, sinv2, ndi, nshr)
      integer ndi, nshr, k
      double precision stress(*), sinv1, sinv2
      sinv1 = (stress(1) + stress(2) + stress(3))/3
      sinv2 = 0
      do k = 1, ndi
         sinv2 = sinv2 + (stress(k) - sinv1)**2
      end do
      do k = ndi + 1, ndi + nshr
         sinv2 = sinv2 + 2*stress(k)**2
      end do
      sinv2 = sqrt(1.5d0*sinv2)
      end

c     Principal values of a stress (lstr 1) or a strain (lstr 2: shear is the engineering one), in no order.
      subroutine sprinc(s, ps, lstr, ndi, nshr)
      integer lstr, ndi, nshr
      double precision s(*), ps(3), f, mean, d1, d2, d3, a, b, c, j2, j3, angle, third
      parameter (third = 2.0943951023931953d0)
      f = 1
      if (lstr .eq. 2) f = 0.5d0
      mean = (s(1) + s(2) + s(3))/3
      d1 = s(1) - mean
      d2 = s(2) - mean
      d3 = s(3) - mean
      a = f*s(4)
      b = 0
      c = 0
      if (nshr .gt. 1) b = f*s(5)
      if (nshr .gt. 2) c = f*s(6)
      j2 = 0.5d0*(d1**2 + d2**2 + d3**2) + a**2 + b**2 + c**2
      j3 = d1*d2*d3 + 2*a*b*c - d1*c**2 - d2*b**2 - d3*a**2
      angle = 0
      if (j2 .gt. 0) angle = acos(max(-1.d0, min(1.d0, 0.5d0*j3*sqrt(27/j2**3))))/3
      ps(1) = mean + 2*sqrt(j2/3)*cos(angle)
      ps(2) = mean + 2*sqrt(j2/3)*cos(angle - third)
      ps(3) = mean + 2*sqrt(j2/3)*cos(angle + third)
      end

c     A stress (lstr 1) or strain (lstr 2) turned: R S R^T.
      subroutine rotsig(s, r, sprime, lstr, ndi, nshr)
      integer lstr, ndi, nshr, i, j
      double precision s(*), r(3, 3), sprime(*), f, m(3, 3)
      f = 1
      if (lstr .eq. 2) f = 0.5d0
      m(1, 1) = s(1)
      m(2, 2) = s(2)
      m(3, 3) = s(3)
      m(1, 2) = f*s(4)
      m(1, 3) = f*s(5)
      m(2, 3) = f*s(6)
      do i = 2, 3
         do j = 1, i - 1
            m(i, j) = m(j, i)
         end do
      end do
      m = matmul(r, matmul(m, transpose(r)))
      sprime(1) = m(1, 1)
      sprime(2) = m(2, 2)
      sprime(3) = m(3, 3)
      sprime(4) = m(1, 2)/f
      sprime(5) = m(1, 3)/f
      sprime(6) = m(2, 3)/f
      end
