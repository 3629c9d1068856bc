c     Prager's kinematic hardening, fixed form, old template, SINV and an error message of the program's own
c     props: E, nu, yield stress, kinematic modulus C; state: back stress (6)
      subroutine vumat(
     1  nblock, ndir, nshr, nstatev, nfieldv, nprops, lanneal,
     2  stepTime, totalTime, dt, cmname, coordMp, charLength,
     3  props, density, strainInc, relSpinInc,
     4  tempOld, stretchOld, defgradOld, fieldOld,
     3  stressOld, stateOld, enerInternOld, enerInelasOld,
     6  tempNew, stretchNew, defgradNew, fieldNew,
     5  stressNew, stateNew, enerInternNew, enerInelasNew )
      include 'vaba_param.inc'
      dimension props(nprops), density(nblock), coordMp(nblock,*),
     1  charLength(nblock), strainInc(nblock,ndir+nshr),
     2  relSpinInc(nblock,nshr), tempOld(nblock),
     3  stretchOld(nblock,ndir+nshr), defgradOld(nblock,ndir+nshr+nshr),
     4  fieldOld(nblock,nfieldv), stressOld(nblock,ndir+nshr),
     5  stateOld(nblock,nstatev), enerInternOld(nblock),
     6  enerInelasOld(nblock), tempNew(nblock),
     7  stretchNew(nblock,ndir+nshr), defgradNew(nblock,ndir+nshr+nshr),
     8  fieldNew(nblock,nfieldv), stressNew(nblock,ndir+nshr),
     9  stateNew(nblock,nstatev), enerInternNew(nblock),
     1  enerInelasNew(nblock)
      character*80 cmname
      dimension s(6), d(6), intv(1), realv(1)
      character*8 charv(1)
      intv(1) = nprops
      realv(1) = 0.d0
      if (nprops .lt. 4) call xplb_abqerr(-3, 'needs 4 constants, got %I',
     1   intv, realv, charv)
      g = props(1)/(2.d0*(1.d0 + props(2)))
      bulk = props(1)/(3.d0*(1.d0 - 2.d0*props(2)))
      c = props(4)
      do i = 1, nblock
         ev = strainInc(i,1) + strainInc(i,2) + strainInc(i,3)
         call sinvof(stressOld, nblock, i, ndir, nshr, p)
         do k = 1, 3
            s(k) = stressOld(i,k) - p + 2.d0*g*(strainInc(i,k)
     1             - ev/3.d0)
            s(k+3) = stressOld(i,k+3) + 2.d0*g*strainInc(i,k+3)
         end do
         pnew = p + bulk*ev
         q = 0.d0
         do k = 1, 6
            d(k) = s(k) - stateOld(i,k)
            f = 1.d0
            if (k .gt. 3) f = 2.d0
            q = q + f*d(k)*d(k)
         end do
         q = sqrt(1.5d0*q)
         dg = 0.d0
         if (totalTime .gt. 0.d0) dg = max(0.d0, (q - props(3))
     1        /(3.d0*g + c))
         do k = 1, 6
            an = 0.d0
            if (dg .gt. 0.d0) an = 1.5d0*d(k)/q
            stateNew(i,k) = stateOld(i,k) + 2.d0/3.d0*c*dg*an
            stressNew(i,k) = s(k) - 2.d0*g*dg*an
            if (k .le. 3) stressNew(i,k) = stressNew(i,k) + pnew
         end do
      end do
      return
      end

      subroutine sinvof(stress, nblock, i, ndir, nshr, p)
      include 'vaba_param.inc'
      dimension stress(nblock,*), one(6)
      do k = 1, ndir + nshr
         one(k) = stress(i,k)
      end do
      call sinv(one, p, q, ndir, nshr)
      return
      end
