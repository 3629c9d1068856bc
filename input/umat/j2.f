c     A user subroutine UMAT: von Mises plasticity with linear hardening. It gives what model='j2' gives
c     (doc/developer/vumat.md). Compile it: make vumat FILE=input/umat/j2.f
c
c     props: Young's modulus (Pa), Poisson's ratio, yield stress (Pa), slope of yield stress over equivalent
c     plastic strain (Pa)
c     state: equivalent plastic strain
      subroutine umat(stress, statev, ddsdde, sse, spd, scd,
     &   rpl, ddsddt, drplde, drpldt,
     &   stran, dstran, time, dtime, temp, dtemp, predef, dpred, cmname,
     &   ndi, nshr, ntens, nstatv, props, nprops, coords, drot, pnewdt,
     &   celent, dfgrd0, dfgrd1, noel, npt, layer, kspt, jstep, kinc)
      include 'aba_param.inc'
      character*80 cmname
      dimension stress(ntens), statev(nstatv), ddsdde(ntens,ntens),
     &   ddsddt(ntens), drplde(ntens), stran(ntens), dstran(ntens),
     &   time(2), predef(1), dpred(1), props(nprops), coords(3),
     &   drot(3,3), dfgrd0(3,3), dfgrd1(3,3), jstep(4)
      parameter (zero = 0.d0, half = 0.5d0, one = 1.d0, two = 2.d0,
     &           three = 3.d0)
      dimension s(6)

      e = props(1)
      xnu = props(2)
      yield = props(3) + props(4)*statev(1)
      hard = props(4)
      twomu = e/(one + xnu)
      amu = half*twomu
      alamda = e*xnu/((one + xnu)*(one - two*xnu))
      bulk = alamda + twomu/three
c     Elastic trial stress; the stress has been turned by drot already
      trace = dstran(1) + dstran(2) + dstran(3)
      do i = 1, 3
         stress(i) = stress(i) + alamda*trace + twomu*dstran(i)
         stress(i+3) = stress(i+3) + amu*dstran(i+3)
      end do
      smean = (stress(1) + stress(2) + stress(3))/three
      do i = 1, 3
         s(i) = stress(i) - smean
         s(i+3) = stress(i+3)
      end do
      q = sqrt(half*((stress(1) - stress(2))**2
     &       + (stress(2) - stress(3))**2 + (stress(3) - stress(1))**2)
     &    + three*(s(4)*s(4) + s(5)*s(5) + s(6)*s(6)))
c     Return along the deviator
      deqps = max(zero, (q - yield)/(three*amu + hard))
      factor = one
      if (deqps .gt. zero) factor = one - three*amu*deqps/q
      do i = 1, 3
         stress(i) = smean + factor*s(i)
         stress(i+3) = factor*s(i+3)
      end do
      statev(1) = statev(1) + deqps
c     The consistent tangent: what dstran does to the mean, to the deviator, and to its factor
      slope = zero
      if (deqps .gt. zero)
     &   slope = three*amu*(deqps/q - one/(three*amu + hard))
     &           *three*amu/(q*q)
      do j = 1, 6
         do i = 1, 6
            ddsdde(i,j) = slope*s(i)*s(j)
         end do
      end do
      do j = 1, 3
         do i = 1, 3
            ddsdde(i,j) = ddsdde(i,j) + bulk - factor*twomu/three
         end do
         ddsdde(j,j) = ddsdde(j,j) + factor*twomu
         ddsdde(j+3,j+3) = ddsdde(j+3,j+3) + factor*amu
      end do
      spd = spd + (yield + half*hard*deqps)*deqps
      return
      end
