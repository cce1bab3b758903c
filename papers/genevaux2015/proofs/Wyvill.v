From Coq Require Import Reals Lra Psatz.
From Coquelicot Require Import Coquelicot.
Open Scope R_scope.

(** Wyvill's falloff on [0, r): g(x) = (1 - (x/r)^2)^3 (Genevaux 2015, 4.1 and appendix). *)
Definition g (r x : R) := (1 - (x / r) ^ 2) ^ 3.
Definition g' (r x : R) := - 6 * x * (r ^ 2 - x ^ 2) ^ 2 / r ^ 6.
Definition lam (r : R) := 96 * sqrt 5 / (125 * r).

(** the printed derivative is right *)
Lemma g_derive r x : r <> 0 -> is_derive (g r) x (g' r x).
Proof. intros Hr. unfold g, g'. auto_derive; [exact I|]. field. exact Hr. Qed.

(** the printed second derivative is right *)
Lemma g'_derive r x : r <> 0 -> is_derive (g' r) x (-6 * (r^2 - x^2) * (r^2 - 5 * x^2) / r^6).
Proof. intros Hr. unfold g'. auto_derive; [repeat apply Rmult_integral_contrapositive_currified; trivial; lra|]. field. exact Hr. Qed.

(** exact core, u = x^2/r^2: 36 u (1-u)^4 <= 9216/3125 = (96 sqrt5/125)^2.
    certificate: 9216/3125 - 36u(1-u)^4 = (36/3125)(1-5u)^2 (256 - 565u + 450u^2 - 125u^3) *)
Lemma core u : 0 <= u <= 1 -> 36 * u * (1 - u) ^ 4 <= 9216 / 3125.
Proof.
  intros Hu.
  assert (E : 9216 / 3125 - 36 * u * (1 - u) ^ 4
              = (36/3125) * (1 - 5*u)^2 * (256 - 565*u + 450*u^2 - 125*u^3)) by field.
  assert (Q : 256 - 565*u + 450*u^2 - 125*u^3 = 16 + (1-u) * (240 - 325*u + 125*u^2)) by ring.
  assert (0 <= 240 - 325*u + 125*u^2) by (assert (0 <= (25*u - 65/2)^2) by apply pow2_ge_0; nra).
  assert (0 <= 256 - 565*u + 450*u^2 - 125*u^3) by (rewrite Q; nra).
  assert (0 <= (36/3125) * (1 - 5*u)^2 * (256 - 565*u + 450*u^2 - 125*u^3)).
  { apply Rmult_le_pos; [apply Rmult_le_pos; [lra|apply pow2_ge_0]|assumption]. }
  lra.
Qed.

(** The constant WYVILL_SLOPE / r. model/src/falloff.rs; every weight's slope rests on it. *)
Lemma g'_bound r x : 0 < r -> 0 <= x <= r -> Rabs (g' r x) <= lam r.
Proof.
  intros Hr Hx.
  set (y := x / r). assert (Hy : 0 <= y <= 1).
  { unfold y; split; [apply Rmult_le_pos; [lra|left; apply Rinv_0_lt_compat; lra]|].
    apply Rmult_le_reg_r with r; [lra|]. unfold Rdiv. rewrite Rmult_assoc, Rinv_l by lra. lra. }
  assert (E : g' r x = - (6 * y * (1 - y^2)^2) / r) by (unfold g', y; field; lra).
  assert (B : 6 * y * (1 - y^2)^2 <= 96 * sqrt 5 / 125).
  { apply Rsqr_incr_0_var; [|assert (0 <= sqrt 5) by apply sqrt_pos; lra].
    replace (Rsqr (96 * sqrt 5 / 125)) with (9216 / 3125).
    - replace (Rsqr (6 * y * (1 - y^2)^2)) with (36 * (y^2) * (1 - y^2)^4) by (unfold Rsqr; ring).
      apply core. nra.
    - unfold Rsqr. replace (96 * sqrt 5 / 125 * (96 * sqrt 5 / 125)) with (9216 / 15625 * (sqrt 5 * sqrt 5)) by field.
      rewrite sqrt_sqrt by lra. field. }
  assert (0 <= 6 * y * (1 - y^2)^2) by (apply Rmult_le_pos; [lra|apply pow2_ge_0]).
  rewrite E. unfold lam. replace (- (6 * y * (1 - y ^ 2) ^ 2) / r) with (- (6 * y * (1 - y ^ 2) ^ 2 / r)) by (field; lra).
  rewrite Rabs_Ropp, Rabs_pos_eq.
  - replace (96 * sqrt 5 / (125 * r)) with ((96 * sqrt 5 / 125) / r) by (field; lra).
    apply Rmult_le_compat_r; [left; apply Rinv_0_lt_compat; lra|exact B].
  - apply Rmult_le_pos; [lra|left; apply Rinv_0_lt_compat; lra].
Qed.

(** attained *)
Lemma g'_attained r : 0 < r -> Rabs (g' r (r / sqrt 5)) = lam r.
Proof.
  intros Hr. unfold g', lam. assert (S : sqrt 5 <> 0) by (apply Rgt_not_eq, sqrt_lt_R0; lra).
  assert (S2 : sqrt 5 ^ 2 = 5) by (simpl; rewrite Rmult_1_r; apply sqrt_sqrt; lra).
  replace (-6 * (r / sqrt 5) * (r ^ 2 - (r / sqrt 5) ^ 2) ^ 2 / r ^ 6)
    with (- (6 * sqrt 5 / (sqrt 5 ^ 2) * (1 - 1 / sqrt 5 ^ 2) ^ 2 / r)) by (field; split; auto; lra).
  rewrite S2, Rabs_Ropp, Rabs_pos_eq.
  - field. lra.
  - assert (0 < sqrt 5) by (apply sqrt_lt_R0; lra). assert (0 < / r) by (apply Rinv_0_lt_compat; lra).
    unfold Rdiv. repeat apply Rmult_le_pos; try lra; nra.
Qed.

(** The quintic fade 6t^5 - 15t^4 + 10t^3. model/src/falloff.rs: fade. *)
Lemma dfade_bound t : 0 <= t <= 1 -> Rabs (30 * t^2 * (1 - t)^2) <= 15 / 8.
Proof.
  intros H. set (p := t * (1 - t)). assert (Hp : 0 <= p <= 1/4) by (unfold p; assert (0 <= (t - 1/2)^2) by apply pow2_ge_0; split; nra).
  replace (30 * t^2 * (1 - t)^2) with (30 * (p * p)) by (unfold p; ring).
  rewrite Rabs_pos_eq; nra.
Qed.

(** 3s^2 - 2s^3: slope at most 3/2, model/src/detail.rs: smooth_slope. *)
Lemma dsmooth_bound t : 0 <= t <= 1 -> 0 <= 6 * t * (1 - t) <= 3 / 2.
Proof. intros H. assert (0 <= (t - 1/2)^2) by apply pow2_ge_0. split; nra. Qed.

(** The maximum of g' is 0, at the centre: the constant is that of |g'|. *)
Lemma g'_not_positive r x : 0 < r -> 0 <= x -> g' r x <= 0.
Proof.
  intros Hr Hx. unfold g'. assert (0 < r ^ 6) by (apply pow_lt; assumption).
  assert (0 <= 6 * x * (r ^ 2 - x ^ 2) ^ 2) by (apply Rmult_le_pos; [lra|apply pow2_ge_0]).
  replace (-6 * x * (r ^ 2 - x ^ 2) ^ 2 / r ^ 6) with (- (6 * x * (r ^ 2 - x ^ 2) ^ 2 / r ^ 6)) by (field; lra).
  assert (0 <= 6 * x * (r ^ 2 - x ^ 2) ^ 2 / r ^ 6) by (apply Rmult_le_pos; [assumption|left; apply Rinv_0_lt_compat; assumption]).
  lra.
Qed.

(** The set where the weight is positive does not hold its border: {alpha > 0} is open, not compact. *)
Lemma support_is_open r : 0 < r -> g r r = 0 /\ forall x, 0 <= x < r -> 0 < g r x.
Proof.
  intros Hr. split; [unfold g; field; lra|]. intros x Hx. unfold g. apply pow_lt.
  assert (x / r < 1). { apply Rmult_lt_reg_r with r; [lra|]. unfold Rdiv. rewrite Rmult_assoc, Rinv_l; lra. }
  assert (0 <= x / r). { apply Rmult_le_pos; [lra|left; apply Rinv_0_lt_compat; lra]. } nra.
Qed.

(** alpha = g(d) with d the distance to any skeleton, which is 1-Lipschitz: slope L/r. Stated for any pair of points. *)
Lemma weight_lip L (gr : R -> R) d d' dist :
  0 <= L -> (forall x y, Rabs (gr x - gr y) <= L * Rabs (x - y)) -> Rabs (d - d') <= dist -> Rabs (gr d - gr d') <= L * dist.
Proof. intros HL H D. eapply Rle_trans; [apply H|]. apply Rmult_le_compat_l; assumption. Qed.
(** The distance to a set is 1-Lipschitz, in the form that any nearest points give it. *)
Lemma distance_lip (P : Type) (dist : P -> P -> R) (p p' s s' : P) :
  (forall x y z, dist x z <= dist x y + dist y z) -> (forall x y, dist x y = dist y x) ->
  (dist p s <= dist p s') -> (dist p' s' <= dist p' s) -> Rabs (dist p s - dist p' s') <= dist p p'.
Proof.
  intros Tri Sym N N'. pose proof (Tri p p' s'). pose proof (Tri p' p s). rewrite (Sym p' p) in *.
  unfold Rabs; destruct Rcase_abs; lra.
Qed.

(** The second derivative vanishes at r and at r/sqrt5 and nowhere else on the positive side. *)
Lemma second_derivative_zeros r x : 0 < r -> 0 < x ->
  (-6 * (r^2 - x^2) * (r^2 - 5 * x^2) / r^6 = 0 <-> x = r \/ x * sqrt 5 = r).
Proof.
  intros Hr Hx. assert (P : r ^ 6 <> 0) by (apply pow_nonzero; lra).
  assert (S : 0 < sqrt 5) by (apply sqrt_lt_R0; lra). assert (S2 : sqrt 5 * sqrt 5 = 5) by (apply sqrt_sqrt; lra).
  split.
  - intros E. assert (Z : (r^2 - x^2) * (r^2 - 5 * x^2) = 0).
    { apply Rmult_eq_reg_l with (-6 / r ^ 6).
      - rewrite Rmult_0_r, <- E. field. lra.
      - unfold Rdiv. apply Rmult_integral_contrapositive_currified; [lra|apply Rinv_neq_0_compat; assumption]. }
    apply Rmult_integral in Z. destruct Z as [Z|Z]; [left|right].
    + assert ((r - x) * (r + x) = 0) by (rewrite <- Z; ring). apply Rmult_integral in H. lra.
    + assert ((r - x * sqrt 5) * (r + x * sqrt 5) = 0).
      { replace ((r - x * sqrt 5) * (r + x * sqrt 5)) with (r^2 - x^2 * (sqrt 5 * sqrt 5)) by ring. rewrite S2, <- Z. ring. }
      apply Rmult_integral in H. assert (0 < x * sqrt 5) by (apply Rmult_lt_0_compat; assumption). lra.
  - intros [E|E]; subst; [field; lra|].
    replace ((x * sqrt 5) ^ 2) with (x ^ 2 * (sqrt 5 * sqrt 5)) by ring. rewrite S2.
    replace (x ^ 2 * 5 - 5 * x ^ 2) with 0 by ring. unfold Rdiv. ring.
Qed.
