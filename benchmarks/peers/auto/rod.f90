!  The perfectly anisotropic rod between two clamps, for AUTO-07p (IPS = 4, NDIM = NBC = 13).
!
!  U = (N1, N2, N3, M1, M2, M3, q0, q1, q2, q3, x, y, z): force and moment in the body frame, unit quaternion, position.
!  PAR(1) = dD (shear), PAR(2) = dL (compression), PAR(3) = psi0 (clamp angle, radians), PAR(4) = a = EI1/GJ,
!  PAR(5) = height, the integral of y (output only).
!  M1 = a k1, M3 = tau, k2 = 0 and M2 is its multiplier.

      SUBROUTINE FUNC(NDIM,U,ICP,PAR,IJAC,F,DFDU,DFDP)
      IMPLICIT NONE
      INTEGER, INTENT(IN) :: NDIM, ICP(*), IJAC
      DOUBLE PRECISION, INTENT(IN) :: U(NDIM), PAR(*)
      DOUBLE PRECISION, INTENT(OUT) :: F(NDIM)
      DOUBLE PRECISION, INTENT(INOUT) :: DFDU(NDIM,NDIM), DFDP(NDIM,*)
      DOUBLE PRECISION b, n1, n2, n3, m1, m2, m3, q0, q1, q2, q3, k, t, hk, ht

      b = 1d0/PAR(4)
      n1 = U(1); n2 = U(2); n3 = U(3)
      m1 = U(4); m2 = U(5); m3 = U(6)
      q0 = U(7); q1 = U(8); q2 = U(9); q3 = U(10)
      k = b*m1
      t = m3
      hk = 0.5d0*k
      ht = 0.5d0*t

      F(1) = n2*t
      F(2) = -n1*t + n3*k
      F(3) = -n2*k
      F(4) = m2*t + n2
      F(5) = -m1*t + m3*k - n1
      F(6) = -m2*k
      F(7) = -q1*hk - q3*ht
      F(8) = q0*hk + q2*ht
      F(9) = q3*hk - q1*ht
      F(10) = -q2*hk + q0*ht
      F(11) = 2d0*(q1*q3 + q0*q2)
      F(12) = 2d0*(q2*q3 - q0*q1)
      F(13) = 2d0*(q0*q0 + q3*q3) - 1d0

      ! AUTO hands over DFDU filled with zeros; the right-hand sides depend on no continuation parameter.
      IF(IJAC.EQ.0) RETURN
      DFDU(1,2) = t;     DFDU(1,6) = n2
      DFDU(2,1) = -t;    DFDU(2,3) = k;      DFDU(2,4) = b*n3;  DFDU(2,6) = -n1
      DFDU(3,2) = -k;    DFDU(3,4) = -b*n2
      DFDU(4,2) = 1d0;   DFDU(4,5) = t;      DFDU(4,6) = m2
      DFDU(5,1) = -1d0;  DFDU(5,4) = b*m3 - t
      DFDU(5,6) = k - m1
      DFDU(6,4) = -b*m2; DFDU(6,5) = -k
      b = 0.5d0*b
      DFDU(7,4) = -b*q1; DFDU(7,6) = -0.5d0*q3; DFDU(7,8) = -hk; DFDU(7,10) = -ht
      DFDU(8,4) = b*q0;  DFDU(8,6) = 0.5d0*q2;  DFDU(8,7) = hk;  DFDU(8,9) = ht
      DFDU(9,4) = b*q3;  DFDU(9,6) = -0.5d0*q1; DFDU(9,8) = -ht; DFDU(9,10) = hk
      DFDU(10,4) = -b*q2; DFDU(10,6) = 0.5d0*q0; DFDU(10,7) = ht; DFDU(10,9) = -hk
      DFDU(11,7) = 2d0*q2;  DFDU(11,8) = 2d0*q3;  DFDU(11,9) = 2d0*q0; DFDU(11,10) = 2d0*q1
      DFDU(12,7) = -2d0*q1; DFDU(12,8) = -2d0*q0; DFDU(12,9) = 2d0*q3; DFDU(12,10) = 2d0*q2
      DFDU(13,7) = 4d0*q0;  DFDU(13,10) = 4d0*q3
      IF(IJAC.EQ.1) RETURN
      DFDP(:,ICP(1)) = 0d0
      END SUBROUTINE FUNC

      SUBROUTINE STPNT(NDIM,U,PAR,T)
!     The circle: psi0 = pi, dL = 1, dD = 0, k1 = 2 pi.
      IMPLICIT NONE
      INTEGER, INTENT(IN) :: NDIM
      DOUBLE PRECISION, INTENT(INOUT) :: U(NDIM), PAR(*)
      DOUBLE PRECISION, INTENT(IN) :: T
      DOUBLE PRECISION, PARAMETER :: PI = 3.14159265358979324d0
      DOUBLE PRECISION h

      h = 1d0/SQRT(2d0)
      PAR(1:5) = (/ 0d0, 1d0, PI, 0.625d0, 1d0/(2d0*PI) /)
      U(1:3) = 0d0
      U(4:6) = (/ 2d0*PI*PAR(4), 0d0, 0d0 /)
      U(7:10) = h*(/ SIN(PI*T), -COS(PI*T), SIN(PI*T), COS(PI*T) /)
      U(11:13) = (/ -SIN(2d0*PI*T), 1d0 - COS(2d0*PI*T), 0d0 /)/(2d0*PI)
      END SUBROUTINE STPNT

      SUBROUTINE BCND(NDIM,PAR,ICP,NBC,U0,U1,FB,IJAC,DBC)
!     q(0) and X(0) given; X(1) given; vec(conj(p) q(1)) = 0 with p = (c, s, c, -s), which leaves |q| to the equations.
      IMPLICIT NONE
      INTEGER, INTENT(IN) :: NDIM, ICP(*), NBC, IJAC
      DOUBLE PRECISION, INTENT(IN) :: PAR(*), U0(NDIM), U1(NDIM)
      DOUBLE PRECISION, INTENT(OUT) :: FB(NBC)
      DOUBLE PRECISION, INTENT(INOUT) :: DBC(NBC,*)
      DOUBLE PRECISION c, s, dc, ds, g(3,4)
      INTEGER i, j

      c = COS(0.5d0*PAR(3))/SQRT(2d0)
      s = SIN(0.5d0*PAR(3))/SQRT(2d0)
      g = CONJUGATE_PRODUCT(c, s)
      FB(1:4) = U0(7:10) - (/ c, -s, c, s /)
      FB(5:7) = U0(11:13) - (/ 0d0, 0d0, -PAR(1) /)
      FB(8:10) = U1(11:13) - (/ 1d0 - PAR(2), 0d0, 0d0 /)
      FB(11:13) = MATMUL(g, U1(7:10))

      IF(IJAC.EQ.0) RETURN
      DBC(1:NBC,1:2*NDIM) = 0d0
      DO i=1,7
        DBC(i,6+i) = 1d0
      ENDDO
      DO i=1,3
        DBC(7+i,NDIM+10+i) = 1d0
        DO j=1,4
          DBC(10+i,NDIM+6+j) = g(i,j)
        ENDDO
      ENDDO
      IF(IJAC.EQ.1) RETURN
      j = 2*NDIM + ICP(1)
      DBC(1:NBC,j) = 0d0
      SELECT CASE(ICP(1))
      CASE(1)
        DBC(7,j) = 1d0
      CASE(2)
        DBC(8,j) = 1d0
      CASE(3)
        dc = -0.5d0*s
        ds = 0.5d0*c
        DBC(1:4,j) = -(/ dc, -ds, dc, ds /)
        DBC(11:13,j) = MATMUL(CONJUGATE_PRODUCT(dc, ds), U1(7:10))
      END SELECT

      CONTAINS

      FUNCTION CONJUGATE_PRODUCT(c, s) RESULT(g)
!     The 3 x 4 matrix g of vec(conj(p) q) = g q for p = (c, s, c, -s).
      DOUBLE PRECISION, INTENT(IN) :: c, s
      DOUBLE PRECISION g(3,4)
      g(1,:) = (/ -s, c, -s, -c /)
      g(2,:) = (/ -c, s, c, s /)
      g(3,:) = (/ s, c, -s, c /)
      END FUNCTION CONJUGATE_PRODUCT

      END SUBROUTINE BCND

      SUBROUTINE ICND
      END SUBROUTINE ICND

      SUBROUTINE FOPT
      END SUBROUTINE FOPT

      SUBROUTINE PVLS(NDIM,U,PAR)
      IMPLICIT NONE
      INTEGER, INTENT(IN) :: NDIM
      DOUBLE PRECISION, INTENT(IN) :: U(NDIM)
      DOUBLE PRECISION, INTENT(INOUT) :: PAR(*)
      DOUBLE PRECISION, EXTERNAL :: GETP
      PAR(5) = GETP('INT',12,U)
      END SUBROUTINE PVLS
