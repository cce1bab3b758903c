From Coq Require Import Reals Lra Psatz.
Open Scope R_scope.

(** Bounds of columns for the polygonizer (Paris 2019, 7), for amplify, which holds no code yet: samples on a grid, a field of slope
    lambda, and a dilation by what a cell may hide. *)
Lemma abs_between x r : Rabs x <= r -> - r <= x <= r.
Proof. unfold Rabs. destruct Rcase_abs; lra. Qed.

Section Columns.
Variables (P : Type) (dist : P -> P -> R) (F : P -> R) (lambda rho : R).
Hypothesis Lip : forall p q, Rabs (F p - F q) <= lambda * dist p q.
Hypothesis Hl : 0 <= lambda.

(** A point of the surface within rho of a sample: the sample's value is small. *)
Theorem near_surface_is_seen c q : F q = 0 -> dist c q <= rho -> Rabs (F c) <= lambda * rho.
Proof.
  intros Hq Hd. pose proof (Lip c q) as L. rewrite Hq, Rminus_0_r in L.
  eapply Rle_trans; [apply L|]. apply Rmult_le_compat_l; assumption.
Qed.

(** Samples of a column at heights z c; those that are small span an interval, and the surface lies in it, dilated by rho. *)
Variables (z : P -> R) (lo hi : R).
Hypothesis Hz : forall p q, Rabs (z p - z q) <= dist p q.
Theorem dilated_column_contains_surface (sampled : P -> Prop) :
  (forall c, sampled c -> Rabs (F c) <= lambda * rho -> lo <= z c <= hi) ->
  forall q, (exists c, sampled c /\ dist c q <= rho) -> F q = 0 -> lo - rho <= z q <= hi + rho.
Proof.
  intros Span q [c [Hc Hd]] Hq. pose proof (near_surface_is_seen c q Hq Hd) as S. specialize (Span c Hc S).
  pose proof (Hz c q) as Z. assert (Rabs (z c - z q) <= rho) by lra.
  assert (- rho <= z c - z q <= rho) by (apply abs_between; assumption). lra.
Qed.

(** For a heightfield one sample bounds a whole cell. model/src/mesh/deviation.rs encloses by intervals instead. *)
Theorem cell_contains_heights c q : dist c q <= rho -> F c - lambda * rho <= F q <= F c + lambda * rho.
Proof.
  intros Hd. pose proof (Lip c q) as L. assert (lambda * dist c q <= lambda * rho) by (apply Rmult_le_compat_l; assumption).
  assert (- (lambda * rho) <= F c - F q <= lambda * rho) by (apply abs_between; lra). lra.
Qed.
End Columns.

(** Without dilation a surface between two samples is lost: F(x) = x on samples -1 and 2 with a narrower threshold. *)
Lemma undilated_false : exists (F : R -> R) c q, (forall x y, Rabs (F x - F y) <= 1 * Rabs (x - y)) /\ F q = 0 /\
  Rabs (c - q) <= 1 /\ ~ (c <= q <= c).
Proof. exists (fun x => x), 1, 0. repeat split; try lra; [intros; lra|rewrite Rabs_pos_eq; lra]. Qed.
