c     J2 with a table of yield stresses, as props(3:): stress, strain, stress, strain ...; old template, GO TO
      subroutine vumat(
     &   nblock, ndir, nshr, nstatev, nfieldv, nprops, lanneal,
     &   stepTime, totalTime, dt, cmname, coordMp, charLength,
     &   props, density, strainInc, relSpinInc,
     &   tempOld, stretchOld, defgradOld, fieldOld,
     &   stressOld, stateOld, enerInternOld, enerInelasOld,
     &   tempNew, stretchNew, defgradNew, fieldNew,
     &   stressNew, stateNew, enerInternNew, enerInelasNew )
      INCLUDE 'vaba_param.inc'
      dimension props(nprops), density(nblock),
     &   strainInc(nblock,ndir+nshr), stressOld(nblock,ndir+nshr),
     &   stateOld(nblock,nstatev), stressNew(nblock,ndir+nshr),
     &   stateNew(nblock,nstatev)
      character*80 cmname
      character*8 name
      real*8 tr(6)
      name = cmname(1:8)
      if (name(1:4) .ne. 'LAW ' .and. name(1:4) .ne. 'LAW') call xit
      g = props(1)/(2*(1 + props(2)))
      alam = 2*g*props(2)/(1 - 2*props(2))
      do 500 k = 1, nblock
         trace = strainInc(k,1) + strainInc(k,2) + strainInc(k,3)
         do i = 1, 6
            tr(i) = stressOld(k,i) + 2*g*strainInc(k,i)
            if (i .le. 3) tr(i) = tr(i) + alam*trace
         end do
         pm = (tr(1) + tr(2) + tr(3))/3
         q = sqrt(1.5d0*((tr(1)-pm)**2 + (tr(2)-pm)**2 + (tr(3)-pm)**2
     &       + 2*(tr(4)**2 + tr(5)**2 + tr(6)**2)))
         eqp = stateOld(k,1)
         deq = 0
         if (totalTime .le. 0) go to 400
c        Newton on the piece of the table
         do iter = 1, 30
            call yieldof(props, nprops, eqp + deq, y, h)
            res = q - 3*g*deq - y
            if (iter .eq. 1 .and. res .le. 0) go to 400
            deq = deq + res/(3*g + h)
            if (abs(res) .lt. 1.d-9*y) go to 400
         end do
         call xplb_exit
400      fac = 1
         if (deq .gt. 0) fac = 1 - 3*g*deq/q
         do i = 1, 6
            if (i .le. 3) stressNew(k,i) = pm + fac*(tr(i) - pm)
            if (i .gt. 3) stressNew(k,i) = fac*tr(i)
         end do
         stateNew(k,1) = eqp + deq
500   continue
      return
      end

      subroutine yieldof(props, nprops, eqp, y, h)
      include 'vaba_param.inc'
      dimension props(nprops)
      n = (nprops - 2)/2
      do j = 2, n
         e1 = props(2*j)
         e2 = props(2*j + 2)
         if (eqp .le. e2) then
            h = (props(2*j + 1) - props(2*j - 1))/(e2 - e1)
            y = props(2*j - 1) + h*(eqp - e1)
            return
         end if
      end do
      h = 0
      y = props(2*n + 1)
      return
      end
