c     A user subroutine VUMAT: von Mises plasticity with linear hardening, elastic law in Jaumann's rate. It gives what model='j2'
c     gives (doc/developer/vumat.md). Compile it: make vumat FILE=input/vumat/j2.f
c
c     props: Young's modulus (Pa), Poisson's ratio, yield stress (Pa), slope of yield stress over equivalent plastic strain (Pa)
c     state: equivalent plastic strain
      subroutine vumat(
     &   nblock, ndir, nshr, nstatev, nfieldv, nprops, lanneal,
     &   stepTime, totalTime, dt, cmname, coordMp, charLength,
     &   props, density, strainInc, relSpinInc,
     &   tempOld, stretchOld, defgradOld, fieldOld,
     &   stressOld, stateOld, enerInternOld, enerInelasOld,
     &   tempNew, stretchNew, defgradNew, fieldNew,
     &   stressNew, stateNew, enerInternNew, enerInelasNew )
      include 'vaba_param.inc'
      dimension props(nprops), density(nblock), coordMp(nblock,*),
     &   charLength(nblock), strainInc(nblock,ndir+nshr),
     &   relSpinInc(nblock,nshr), tempOld(nblock),
     &   stretchOld(nblock,ndir+nshr),
     &   defgradOld(nblock,ndir+nshr+nshr),
     &   fieldOld(nblock,nfieldv), stressOld(nblock,ndir+nshr),
     &   stateOld(nblock,nstatev), enerInternOld(nblock),
     &   enerInelasOld(nblock), tempNew(nblock),
     &   stretchNew(nblock,ndir+nshr),
     &   defgradNew(nblock,ndir+nshr+nshr),
     &   fieldNew(nblock,nfieldv),
     &   stressNew(nblock,ndir+nshr), stateNew(nblock,nstatev),
     &   enerInternNew(nblock), enerInelasNew(nblock)
      character*80 cmname
      parameter (zero = 0.d0, half = 0.5d0, one = 1.d0, two = 2.d0,
     &           three = 3.d0, quarter = 0.25d0)
      dimension s(6), t(3,3), r(3,3), w(3)

      e = props(1)
      xnu = props(2)
      yield0 = props(3)
      hard = props(4)
      twomu = e/(one + xnu)
      alamda = e*xnu/((one + xnu)*(one - two*xnu))

      do k = 1, nblock
c        The turn of the material beyond that of the frame (axial vector: 32, 13, 21), as a rotation by Cayley's transform:
c        with it the rate is Jaumann's; without it, Green and Naghdi's
         w(1) = relSpinInc(k,1)
         w(2) = relSpinInc(k,2)
         w(3) = relSpinInc(k,3)
         c = one/(one + quarter*(w(1)*w(1) + w(2)*w(2) + w(3)*w(3)))
         r(1,1) = one - half*c*(w(2)*w(2) + w(3)*w(3))
         r(2,2) = one - half*c*(w(1)*w(1) + w(3)*w(3))
         r(3,3) = one - half*c*(w(1)*w(1) + w(2)*w(2))
         r(1,2) = c*(half*w(1)*w(2) - w(3))
         r(2,1) = c*(half*w(1)*w(2) + w(3))
         r(1,3) = c*(half*w(1)*w(3) + w(2))
         r(3,1) = c*(half*w(1)*w(3) - w(2))
         r(2,3) = c*(half*w(2)*w(3) - w(1))
         r(3,2) = c*(half*w(2)*w(3) + w(1))
         do i = 1, 3
            t(i,1) = r(i,1)*stressOld(k,1) + r(i,2)*stressOld(k,4)
     &             + r(i,3)*stressOld(k,6)
            t(i,2) = r(i,1)*stressOld(k,4) + r(i,2)*stressOld(k,2)
     &             + r(i,3)*stressOld(k,5)
            t(i,3) = r(i,1)*stressOld(k,6) + r(i,2)*stressOld(k,5)
     &             + r(i,3)*stressOld(k,3)
         end do
c        Elastic trial stress
         trace = alamda*(strainInc(k,1) + strainInc(k,2)
     &                   + strainInc(k,3))
         do i = 1, 3
            s(i) = t(i,1)*r(i,1) + t(i,2)*r(i,2) + t(i,3)*r(i,3)
     &             + trace + twomu*strainInc(k,i)
         end do
         s(4) = t(1,1)*r(2,1) + t(1,2)*r(2,2) + t(1,3)*r(2,3)
     &          + twomu*strainInc(k,4)
         s(5) = t(2,1)*r(3,1) + t(2,2)*r(3,2) + t(2,3)*r(3,3)
     &          + twomu*strainInc(k,5)
         s(6) = t(1,1)*r(3,1) + t(1,2)*r(3,2) + t(1,3)*r(3,3)
     &          + twomu*strainInc(k,6)
c        Return along the deviator
         smean = (s(1) + s(2) + s(3))/three
         q = sqrt(half*((s(1) - s(2))**2 + (s(2) - s(3))**2
     &        + (s(3) - s(1))**2)
     &        + three*(s(4)*s(4) + s(5)*s(5) + s(6)*s(6)))
         yield = yield0 + hard*stateOld(k,1)
         deqps = zero
         if (totalTime .gt. zero) deqps =
     &      max(zero, (q - yield)/(1.5d0*twomu + hard))
         factor = one
         if (deqps .gt. zero) factor = one - 1.5d0*twomu*deqps/q
         do i = 1, 3
            stressNew(k,i) = smean + factor*(s(i) - smean)
            stressNew(k,i+3) = factor*s(i+3)
         end do
         stateNew(k,1) = stateOld(k,1) + deqps
c        Energies per mass
         power = zero
         do i = 1, 3
            power = power
     &      + half*(stressOld(k,i) + stressNew(k,i))*strainInc(k,i)
     &      + (stressOld(k,i+3) + stressNew(k,i+3))*strainInc(k,i+3)
         end do
         enerInternNew(k) = enerInternOld(k) + power/density(k)
         enerInelasNew(k) = enerInelasOld(k)
     &      + (yield + half*hard*deqps)*deqps/density(k)
      end do
      return
      end
