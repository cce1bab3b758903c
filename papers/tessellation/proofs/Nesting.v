From Coq Require Import Reals Lra Psatz List.
Import ListNotations.
Open Scope R_scope.

(** Run-time refinement by distance and no cracks, for gpu/src/tessellate, which holds no code yet, and as the rule behind
    model/src/mesh/quadtree.rs. A vertex is active when its error, seen from the eye, is too large. *)
Section Refinement.
Variables (V P : Type) (dist : P -> P -> R) (place : V -> P) (radius error : V -> R) (parent : V -> V -> Prop) (tau : R).
Hypothesis tri : forall x y z, dist x z <= dist x y + dist y z.
(** The nesting rule: a parent's ball holds the ball of its child, and its error is no smaller. *)
Hypothesis nested : forall c p, parent c p -> dist (place p) (place c) + radius c <= radius p.
Hypothesis graded : forall c p, parent c p -> error c <= error p.

Definition active (eye : P) (v : V) := dist eye (place v) - radius v <= tau * error v.

Theorem active_parent eye c p : 0 <= tau -> parent c p ->
  (forall x y, dist x y = dist y x) -> active eye c -> active eye p.
Proof.
  intros Ht Hp Sym A. unfold active in *. pose proof (nested c p Hp). pose proof (graded c p Hp).
  pose proof (tri eye (place c) (place p)). rewrite (Sym (place c) (place p)) in *.
  assert (tau * error c <= tau * error p) by (apply Rmult_le_compat_l; assumption). lra.
Qed.

(** Hence the active vertices are closed under parents. In a mesh where a triangle is split exactly at its active vertex, both triangles
    of an edge split it or neither does: what an edge becomes depends on the edge alone. *)
Variable edge : Type.
Variable middle : edge -> V.
Definition split eye (e : edge) := active eye (middle e).
Theorem no_crack eye (e e' : edge) : middle e = middle e' -> (split eye e <-> split eye e').
Proof. intros H. unfold split. rewrite H. tauto. Qed.
End Refinement.

(** Without nesting a child may be active and its parent not: on a line, the eye beside the child. *)
Lemma unnested_false : exists (eye c p rc rp ec ep tau : R),
  0 <= tau /\ ec <= ep /\ Rabs (eye - c) - rc <= tau * ec /\ ~ (Rabs (eye - p) - rp <= tau * ep).
Proof.
  exists 0, 0, 10, 0, 0, 1, 1, 1. repeat split; try lra; [rewrite Rabs_pos_eq|rewrite Rabs_left]; lra.
Qed.

(** Octaves divided by the sum of their amplitudes are a convex combination: Algorithm 1. *)
Fixpoint weighted (l : list (R * R)) : R := match l with [] => 0 | (a, v) :: r => a * v + weighted r end.
Fixpoint amplitudes (l : list (R * R)) : R := match l with [] => 0 | (a, _) :: r => a + amplitudes r end.
Theorem fbm_convex l m : 0 < amplitudes l -> (forall a v, In (a, v) l -> 0 <= a /\ Rabs v <= m) ->
  Rabs (weighted l / amplitudes l) <= m.
Proof.
  intros Ha H.
  assert (B : Rabs (weighted l) <= m * amplitudes l).
  { clear Ha. induction l as [|[a v] r IH]; simpl; [rewrite Rabs_R0; lra|].
    eapply Rle_trans; [apply Rabs_triang|]. destruct (H a v (or_introl eq_refl)) as [P Q].
    assert (Rabs (weighted r) <= m * amplitudes r) by (apply IH; intros; apply H; right; assumption).
    rewrite Rabs_mult, (Rabs_pos_eq a) by assumption. nra. }
  unfold Rdiv. rewrite Rabs_mult, (Rabs_pos_eq (/ amplitudes l)) by (left; apply Rinv_0_lt_compat; assumption).
  apply Rmult_le_reg_r with (amplitudes l); [assumption|]. rewrite Rmult_assoc, Rinv_l by lra. lra.
Qed.
Lemma negative_gain_false : amplitudes [(1, 0); (-1, 0)] = 0.
Proof. simpl. lra. Qed.

(** Noise in space over a height of slope s: at most a lambda sqrt(1 + s^2) per metre of ground, more than a lambda. *)
Lemma steep_noise dx s : 0 <= dx -> sqrt (dx ^ 2 + (s * dx) ^ 2) = sqrt (1 + s ^ 2) * dx.
Proof.
  intros H. replace (dx ^ 2 + (s * dx) ^ 2) with ((1 + s ^ 2) * dx ^ 2) by ring.
  rewrite sqrt_mult by nra. rewrite sqrt_pow2; lra.
Qed.
