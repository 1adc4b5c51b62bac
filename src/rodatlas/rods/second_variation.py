"""proto"""
from __future__ import annotations
from dataclasses import dataclass
import numpy as np
from scipy.interpolate import CubicHermiteSpline
from scipy.linalg import null_space, eigvalsh

# quaternion product matrices: conj(q) r = vec part bilinear q^T B_k r
B = np.zeros((4, 4, 4))
# conj(q) r: scalar q.r ; 
B[0] = np.eye(4)
# vec1: q0 r1 - q1 r0 - (q2 r3 - q3 r2)
B[1][0,1]=1;B[1][1,0]=-1;B[1][2,3]=-1;B[1][3,2]=1
B[2][0,2]=1;B[2][2,0]=-1;B[2][3,1]=-1;B[2][1,3]=1
B[3][0,3]=1;B[3][3,0]=-1;B[3][1,2]=-1;B[3][2,1]=1
T = np.zeros((3,4,4))
T[0][1,3]=T[0][3,1]=T[0][0,2]=T[0][2,0]=1
T[1][2,3]=T[1][3,2]=1; T[1][0,1]=T[1][1,0]=-1
T[2]=np.diag([1,-1,-1,1])

class P:
    def __init__(s, q, chord, stiff, con, load=None):
        s.q=q; s.n=len(q)-1; s.h=1/s.n; s.chord=chord; s.stiff=stiff; s.con=con
        s.wt=np.full(s.n+1,s.h); s.wt[[0,-1]]*=.5
    def system(s,q,lam,force):
        n,h=s.n,s.h
        E=np.zeros((n+1,4,n+1,4)); g=np.zeros((n+1,4))
        v=2/h*np.einsum('kab,ia,ib->ik',B[1:],q[:-1],q[1:])
        l=v*s.stiff
        if s.con: l[:,1]=lam
        dl=2/h*np.einsum('kab,ib->ika',B[1:],q[1:]); dr=2/h*np.einsum('kab,ia->ikb',B[1:],q[:-1])
        g[:-1]+=h*np.einsum('ik,ika->ia',l,dl); g[1:]+=h*np.einsum('ik,ika->ia',l,dr)
        i=np.arange(n)
        E[i,:,i,:]+=h*np.einsum('k,ika,ikb->iab',s.stiff,dl,dl)
        E[i+1,:,i+1,:]+=h*np.einsum('k,ika,ikb->iab',s.stiff,dr,dr)
        c=h*(np.einsum('k,ika,ikb->iab',s.stiff,dl,dr)+2/h*np.einsum('ik,kab->iab',l,B[1:]))
        E[i,:,i+1,:]+=c; E[i+1,:,i,:]+=c.transpose(0,2,1)
        j=np.arange(n+1)
        Tf=np.einsum('k,kab->ab',force,T)
        g+=2*s.wt[:,None]*q@Tf
        E[j,:,j,:]+=2*s.wt[:,None,None]*Tf
        d=np.einsum('kab,ia,ib->ik',T,q,q)
        res=[s.wt@d-s.chord]
        J=[2*np.einsum('i,kab,ib->kia',s.wt,T,q)]
        if s.con:
            res.append(h*v[:,1]); R=np.zeros((n,n+1,4)); R[i,i]=h*dl[:,1]; R[i,i+1]=h*dr[:,1]; J.append(R)
        J=np.concatenate(J); res=np.concatenate(res)
        E[j,:,j,:]-=np.einsum('ia,ia->i',g,q)[:,None,None]*np.eye(4)
        # tangent basis: q o (0,e_k) /2
        Z=np.stack([-B[k].T@q.T for k in (1,2,3)],0) if 0 else np.einsum('kab,ia->ikb',B[1:],q) # conj? check below
        Z=Z/2
        inner=slice(1,n)
        H=np.einsum('ika,iajb,jlb->ikjl',Z[inner],E[inner,:,inner,:],Z[inner],optimize=True).reshape(3*(n-1),-1)
        G=np.einsum('ika,ia->ik',Z[inner],g[inner]).ravel()
        Jt=np.einsum('cia,ika->cik',J[:,inner],Z[inner]).reshape(len(J),-1)
        return H,G,Jt,res,Z

def solve(s,q,strain,a,pos,b=None,segments=100,iters=12):
    q=q.copy()
    for i in range(1,len(q)):
        if q[i]@q[i-1]<0: q[i]*=-1
    k1,k2,t=strain.T; q0,q1,q2,q3=q.T
    dq=np.stack([-q1*k1-q2*k2-q3*t,q0*k1-q3*k2+q2*t,q3*k1+q0*k2-q1*t,-q2*k1+q1*k2+q0*t],1)/2
    nodes=np.linspace(0,1,segments+1)
    Q=CubicHermiteSpline(s,q,dq)(nodes); Q/=np.linalg.norm(Q,axis=1)[:,None]
    p=P(Q,pos[-1]-pos[0],np.array([a,b or 0.,1.]),b is None)
    Q0=Q.copy()
    H,G,J,r,Z=p.system(Q,np.zeros(segments),np.zeros(3))
    mult=np.linalg.lstsq(J.T,-G,rcond=None)[0]
    for it in range(iters):
        H,G,J,r,Z=p.system(Q,mult[3:],mult[:3])
        grad=G
        m=len(mult)
        K=np.block([[H,J.T],[J,np.zeros((m,m))]])
        step=np.linalg.lstsq(K,-np.r_[grad,r],rcond=1e-12)[0] if 0 else np.linalg.solve(K,-np.r_[grad,r])
        ph=step[:len(G)].reshape(-1,3); mult=mult+step[len(G):]
        Q[1:-1]+=np.einsum('ik,ikb->ib',ph,Z[1:-1]); Q/=np.linalg.norm(Q,axis=1)[:,None]
        if np.abs(np.r_[grad,r]).max()<1e-11: break
    N=null_space(J)
    w=np.linalg.eigvalsh(N.T@H@N)*segments
    k=np.linalg.eigvalsh(K)
    return (w<0).sum(), w[:3], (k<0).sum()-np.linalg.matrix_rank(J), it, np.abs(Q-Q0).max(), mult[:3]
