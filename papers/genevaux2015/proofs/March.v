From Coq Require Import Reals Lra Psatz.
Open Scope R_scope.

(** Steps along a ray (Genevaux 2015, 7.1 and 7.2). The ray is o + t u; n = |u_xy|, w = u_z, phi t = f(o_xy + t u_xy), and
    h t = o_z + t w - phi t. Nothing is differentiable: f is lambda-Lipschitz on the candidate segment and nowhere else. *)

Section Step.
Variables (oz w n lambda t delta : R) (phi : R -> R).
Hypothesis Hn : 0 <= n. Hypothesis Hl : 0 <= lambda. Hypothesis Hd : 0 < delta.
Hypothesis Lip : forall x, t <= x <= t + delta -> Rabs (phi x - phi t) <= lambda * n * (x - t).
Definition h (x : R) := oz + x * w - phi x.
Definition c := w - n * lambda.
Definition step := if Rle_dec 0 c then delta else Rmin delta (h t / (- c)).

(** In place of the derivative h' = u_z - |u_xy| f' of 7.2, which need not exist.
    model/src/trace/height_ray.rs: HeightRay::bounds, `slope`. *)
Lemma h_lower x : t <= x <= t + delta -> h t + (x - t) * c <= h x.
Proof.
  intros Hx. pose proof (Lip x Hx) as L. pose proof (Rle_abs (phi x - phi t)).
  unfold h, c. nra.
Qed.

Lemma step_pos : 0 < h t -> 0 < step.
Proof.
  intros H. unfold step. destruct (Rle_dec 0 c); [lra|].
  apply Rmin_glb_lt; [lra|]. apply Rmult_lt_0_compat; [lra|]. apply Rinv_0_lt_compat. lra.
Qed.

Lemma step_le : step <= delta.
Proof. unfold step. destruct (Rle_dec 0 c); [lra|apply Rmin_l]. Qed.

(** The ray stays strictly above the terrain on [t, t + step). model/src/trace/stride.rs, `reach`; sphere.rs: Candidate::step. *)
Theorem step_safe : 0 < h t -> forall x, t <= x < t + step -> 0 < h x.
Proof.
  intros H x Hx. pose proof step_le. pose proof (h_lower x ltac:(lra)) as L.
  unfold step in Hx. destruct (Rle_dec 0 c) as [C|C]; [nra|].
  assert (x - t < h t / - c) by (pose proof (Rmin_r delta (h t / - c)); lra).
  assert (M : (x - t) * (- c) < h t).
  { replace (h t) with (h t / - c * - c) by (field; lra). apply Rmult_lt_compat_r; lra. }
  lra.
Qed.

(** And not below it at t + step. *)
Theorem step_end : 0 < h t -> 0 <= h (t + step).
Proof.
  intros H. pose proof step_le. pose proof (step_pos H).
  pose proof (h_lower (t + step) ltac:(lra)) as L. replace (t + step - t) with step in L by ring.
  unfold step in *. destruct (Rle_dec 0 c) as [C|C]; [nra|].
  assert (M : Rmin delta (h t / - c) * (- c) <= h t).
  { replace (h t) with (h t / - c * - c) at 2 by (field; lra). apply Rmult_le_compat_r; [lra|apply Rmin_r]. }
  lra.
Qed.

(** Never shorter than the classical step with the same lambda: |c| <= sqrt(1 + lambda^2). *)
Theorem step_ge_classical : w ^ 2 + n ^ 2 = 1 -> 0 < h t ->
  Rmin delta (h t / sqrt (1 + lambda ^ 2)) <= step.
Proof.
  intros U H. assert (Q : 0 < sqrt (1 + lambda ^ 2)) by (apply sqrt_lt_R0; nra).
  unfold step. destruct (Rle_dec 0 c) as [C|C]; [apply Rmin_l|].
  apply Rmin_case_strong; intros; [|].
  - apply Rmin_glb; [lra|]. eapply Rle_trans; [eassumption|]. apply Rmult_le_compat_l; [lra|].
    apply Rinv_le_contravar; [lra|]. apply Rsqr_incr_0_var; [|lra]. rewrite Rsqr_sqrt by nra. unfold Rsqr, c.
    assert (0 <= (w * lambda + n) ^ 2) by apply pow2_ge_0. nra.
  - apply Rmin_glb; [lra|]. apply Rmult_le_compat_l; [lra|].
    apply Rinv_le_contravar; [lra|]. apply Rsqr_incr_0_var; [|lra]. rewrite Rsqr_sqrt by nra. unfold Rsqr, c.
    assert (0 <= (w * lambda + n) ^ 2) by apply pow2_ge_0. nra.
Qed.

(** With a direction that is no unit vector it may be shorter. *)
Lemma step_without_unit_false : exists w0 n0 l0, 0 <= n0 /\ 0 <= l0 /\ sqrt (1 + l0 ^ 2) < - (w0 - n0 * l0).
Proof. exists (-3), 0, 0. replace (1 + 0 ^ 2) with 1 by ring. rewrite sqrt_1. lra. Qed.

(** With a budget of rounding: computed are a height that may be off by e, a rate not above the true one, and a quotient that may be
    too long by the share r. Deflating by the same share and by e makes the step safe again: DEFLATE and TOUCH of
    model/src/trace/march.rs. *)
Theorem step_safe_rounded hc cc s e r : 0 <= e -> 0 <= r ->
  Rabs (hc - h t) <= e -> cc <= c -> cc < 0 -> e < hc ->
  s * (1 + r) <= (hc - e) / (- cc) -> s <= delta -> 0 <= s ->
  forall x, t <= x <= t + s * (1 + r) -> x <= t + delta -> 0 <= h x.
Proof.
  intros He Hr Herr Hcc Neg Hpos Hs Hsd Hs0 x Hx Hxd. pose proof (h_lower x ltac:(lra)) as L.
  pose proof (Rle_abs (hc - h t)) as A.
  assert (M : (x - t) * (- cc) <= hc - e).
  { replace (hc - e) with ((hc - e) / (- cc) * (- cc)) by (field; lra). apply Rmult_le_compat_r; lra. }
  assert ((x - t) * cc <= (x - t) * c) by (apply Rmult_le_compat_l; lra). lra.
Qed.
End Step.

(** No root is stepped over: if every root is at or behind t, every root is at or behind t + step. *)
Theorem march_invariant oz w n lambda t delta phi :
  0 <= n -> 0 <= lambda -> 0 < delta ->
  (forall x, t <= x <= t + delta -> Rabs (phi x - phi t) <= lambda * n * (x - t)) ->
  0 < h oz w phi t ->
  (forall x, h oz w phi x = 0 -> t <= x) -> forall x, h oz w phi x = 0 -> t + step oz w n lambda t delta phi <= x.
Proof.
  intros Hn Hl Hd L H I x Hx. destruct (Rle_dec (t + step oz w n lambda t delta phi) x) as [|N]; [assumption|].
  exfalso. specialize (I x Hx).
  assert (0 < h oz w phi x) by (eapply (step_safe oz w n lambda t delta phi); try eassumption; lra). lra.
Qed.

(** lambda of h(x, z) = z - f(x): what 7.1 must divide by. model/src/trace/sphere.rs: trace. *)
Theorem h3_lip dz dxy df lambda : 0 <= dxy -> 0 <= lambda -> Rabs df <= lambda * dxy ->
  Rabs (dz - df) <= sqrt (1 + lambda ^ 2) * sqrt (dz ^ 2 + dxy ^ 2).
Proof.
  intros Hx Hl L. rewrite <- sqrt_mult by nra. apply Rsqr_incr_0_var; [|apply sqrt_pos].
  rewrite Rsqr_sqrt by nra. rewrite <- Rsqr_abs.
  assert (Rabs (dz - df) <= Rabs dz + lambda * dxy) by (eapply Rle_trans; [apply Rabs_triang|rewrite Rabs_Ropp; lra]).
  assert (B : Rsqr (dz - df) <= Rsqr (Rabs dz + lambda * dxy)).
  { rewrite (Rsqr_abs (dz - df)). apply Rsqr_incr_1; [assumption|apply Rabs_pos|]. pose proof (Rabs_pos dz). nra. }
  eapply Rle_trans; [apply B|]. unfold Rsqr. pose proof (Rsqr_abs dz) as A. unfold Rsqr in A.
  assert (0 <= (Rabs dz * lambda - dxy) ^ 2) by apply pow2_ge_0. nra.
Qed.

(** It cannot be less: attained by any displacement across the slope's line of fall. *)
Theorem h3_tight lambda : 0 <= lambda ->
  Rabs (-1 - lambda * lambda) = sqrt (1 + lambda ^ 2) * sqrt ((-1) ^ 2 + lambda ^ 2).
Proof.
  intros Hl. replace ((-1) ^ 2 + lambda ^ 2) with (1 + lambda ^ 2) by ring.
  rewrite sqrt_sqrt by nra. rewrite Rabs_left by nra. ring.
Qed.

(** The definition of 7: with < in place of <= nothing is Lipschitz. *)
Theorem strict_lipschitz_false : forall (k : R -> R) lambda, ~ (forall p q, Rabs (k p - k q) < lambda * Rabs (p - q)).
Proof.
  intros k lambda H. specialize (H 0 0). replace (k 0 - k 0) with 0 in H by ring. replace (0 - 0) with 0 in H by ring.
  rewrite Rabs_R0 in H. lra.
Qed.
(** With p <> q the identity obeys it for every lambda > 1 and not for 1: there is no smallest. With <= the smallest is attained. *)
Theorem strict_has_no_minimum : (forall lambda, 1 < lambda -> forall p q, p <> q -> Rabs (p - q) < lambda * Rabs (p - q)) /\
  ~ (forall p q : R, p <> q -> Rabs (p - q) < 1 * Rabs (p - q)).
Proof.
  split.
  - intros l Hl p q N. assert (0 < Rabs (p - q)) by (apply Rabs_pos_lt; lra). nra.
  - intros H. specialize (H 1 0 ltac:(lra)). lra.
Qed.

(** Both ends of a segment: what the accelerated and the segment tracer share. Slopes of h in [lo, hi] between any two points.
    model/src/trace/stride.rs: `near + back >= span`. *)
Section Segment.
Variables (g : R -> R) (a b lo hi : R).
Hypothesis Hab : a <= b.
Hypothesis Slopes : forall x y, a <= x -> x <= y -> y <= b -> lo * (y - x) <= g y - g x <= hi * (y - x).

Theorem both_ends x : a <= x <= b -> Rmax (g a + lo * (x - a)) (g b - hi * (b - x)) <= g x.
Proof.
  intros H. apply Rmax_lub; [pose proof (Slopes a x ltac:(lra) ltac:(lra) ltac:(lra))|pose proof (Slopes x b ltac:(lra) ltac:(lra) ltac:(lra))]; lra.
Qed.

(** Clear when what either end proves covers the segment. *)
Theorem segment_clear : 0 < g a -> 0 < g b -> lo < 0 -> 0 < hi -> b - a < g a / - lo + g b / hi ->
  forall x, a <= x <= b -> 0 < g x.
Proof.
  intros Ha Hb Hlo Hhi Hs x Hx. pose proof (both_ends x Hx) as B.
  pose proof (Rmax_l (g a + lo * (x - a)) (g b - hi * (b - x))). pose proof (Rmax_r (g a + lo * (x - a)) (g b - hi * (b - x))).
  destruct (Rlt_dec (x - a) (g a / - lo)) as [N|N].
  - assert ((x - a) * - lo < g a).
    { replace (g a) with (g a / - lo * - lo) by (field; lra). apply Rmult_lt_compat_r; lra. } lra.
  - assert (b - x < g b / hi) by lra.
    assert ((b - x) * hi < g b).
    { replace (g b) with (g b / hi * hi) by (field; lra). apply Rmult_lt_compat_r; lra. } lra.
Qed.

(** A climbing segment is clear from its near end alone. *)
Theorem segment_climbs : 0 < g a -> 0 <= lo -> forall x, a <= x <= b -> 0 < g x.
Proof.
  intros Ha Hlo x Hx. pose proof (Slopes a x ltac:(lra) ltac:(lra) ltac:(lra)). assert (0 <= lo * (x - a)) by (apply Rmult_le_pos; lra). lra.
Qed.
End Segment.

(** lambda of f alone is unsafe. *)
Theorem lambda_f_unsafe : exists lambda dz dxy df, 0 < lambda /\ Rabs df <= lambda * dxy /\
  Rabs (dz - df) > lambda * sqrt (dz ^ 2 + dxy ^ 2).
Proof.
  exists (1/2), (-1), 0, 0. rewrite Rabs_R0. repeat split; try lra.
  replace ((-1)^2 + 0^2) with 1 by ring. rewrite sqrt_1, Rminus_0_r, Rabs_left; lra.
Qed.
