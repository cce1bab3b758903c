From Coq Require Import Reals Lra Psatz.
Open Scope R_scope.

(** The sigmoid that makes a solid of a heightfield (Paris 2019, 5.1), y = x/R, tau = T/R; s is (sigma - T)/R on [0, 1]. For the
    implicit terrain, which is still to be built (amplify/src/implicit). *)
Definition s (tau y : R) := y + (3*tau - 2) * y^2 + (1 - 2*tau) * y^3.
Definition s' (tau y : R) := 1 + 2 * (3*tau - 2) * y + 3 * (1 - 2*tau) * y^2.

(** The printed end conditions, but for sigma(0) = 0. *)
Lemma s_ends tau : s tau 0 = 0 /\ s tau 1 = tau /\ s' tau 0 = 1 /\ s' tau 1 = 0.
Proof. unfold s, s'. repeat split; ring. Qed.
Lemma s_factor tau y : s' tau y = (1 - y) * (1 - 3 * (1 - 2*tau) * y).
Proof. unfold s'. ring. Qed.
(** Monotone on [0, R] when R <= 3T. *)
Lemma s_mono tau y : 1/3 <= tau -> 0 <= y <= 1 -> 0 <= s' tau y.
Proof.
  intros Ht Hy. rewrite s_factor. apply Rmult_le_pos; [lra|].
  assert (0 <= (tau - 1/3) * y) by (apply Rmult_le_pos; lra). nra.
Qed.
(** And only then: for R > 3T it falls just before R. *)
Lemma s_falls tau : 0 < tau < 1/3 -> exists y, 0 < y < 1 /\ s' tau y < 0.
Proof.
  intros Ht. set (k := 3 * (1 - 2 * tau)). assert (1 < k) by (unfold k; lra).
  exists ((1 + / k) / 2). assert (/ k < 1) by (rewrite <- Rinv_1; apply Rinv_lt_contravar; lra).
  assert (0 < / k) by (apply Rinv_0_lt_compat; lra). split; [lra|]. rewrite s_factor. fold k.
  assert (E : k * / k = 1) by (field; lra).
  assert (k * ((1 + / k) / 2) > 1) by nra. assert (0 < 1 - (1 + / k) / 2) by lra. nra.
Qed.
(** The printed range [0, 2T] fails for T = 1/2, R = 10: sigma(3.7) > 2 = 4T. *)
Lemma s_overshoot : 1/2 + 10 * s (1/20) (37/100) > 2.
Proof. unfold s. lra. Qed.
(** sigma(0) = T, where 0 is printed. *)
Lemma sigma_at_zero_false T r : 0 < T -> T + r * s (T / r) 0 <> 0.
Proof. intros H. unfold s. replace (r * (0 + (3 * (T / r) - 2) * 0 ^ 2 + (1 - 2 * (T / r)) * 0 ^ 3)) with 0 by ring. lra. Qed.
(** No spurious crossing of the level: s > 0 on (0, 1] for every tau > 0. *)
Lemma s_pos tau y : 0 < tau -> 0 < y <= 1 -> 0 < s tau y.
Proof.
  intros Ht Hy. unfold s.
  replace (y + (3*tau - 2) * y^2 + (1 - 2*tau) * y^3) with (y * ((1-y)^2 + tau * y * (3 - 2*y))) by ring.
  apply Rmult_lt_0_compat; [lra|]. assert (0 <= (1-y)^2) by apply pow2_ge_0.
  assert (0 < tau * y * (3 - 2*y)). { apply Rmult_lt_0_compat; [apply Rmult_lt_0_compat; lra|lra]. } lra.
Qed.

(** sigma = T + R s(|x|/R) with the sign of x, T above and below R: the solid's level set is the heightfield. *)
Definition sigma (T r x : R) :=
  if Rle_dec r x then 2 * T else if Rle_dec x (- r) then 0
  else if Rle_dec 0 x then T + r * s (T / r) (x / r) else T - r * s (T / r) (- x / r).

Theorem level_set_is_heightfield T r h z : 0 < T -> 0 < r -> (sigma T r (h - z) = T <-> z = h).
Proof.
  intros HT Hr. assert (Ht : 0 < T / r) by (apply Rmult_lt_0_compat; [lra|apply Rinv_0_lt_compat; lra]).
  split.
  - intros E. unfold sigma in E. destruct (Rle_dec r (h - z)); [lra|]. destruct (Rle_dec (h - z) (- r)); [lra|].
    assert (P : forall x, 0 < x -> x < r -> 0 < r * s (T / r) (x / r)).
    { intros x Hx Hx'. apply Rmult_lt_0_compat; [lra|]. apply s_pos; [assumption|]. split.
      - apply Rmult_lt_0_compat; [lra|apply Rinv_0_lt_compat; lra].
      - left. apply Rmult_lt_reg_r with r; [lra|]. unfold Rdiv. rewrite Rmult_assoc, Rinv_l; lra. }
    destruct (Rle_dec 0 (h - z)).
    + destruct (Req_dec (h - z) 0); [lra|]. pose proof (P (h - z) ltac:(lra) ltac:(lra)). lra.
    + pose proof (P (- (h - z)) ltac:(lra) ltac:(lra)). lra.
  - intros E. subst. unfold sigma. replace (h - h) with 0 by ring.
    destruct (Rle_dec r 0); [lra|]. destruct (Rle_dec 0 (- r)); [lra|]. destruct (Rle_dec 0 0); [|lra].
    unfold s. replace (0 / r) with 0 by (field; lra). ring.
Qed.

(** The unit-free form T(3y - y^3)/2: within [0, T], rising, for every R. *)
Lemma unit_free_range T y : 0 < T -> 0 <= y <= 1 -> 0 <= T * (3 * y - y ^ 3) / 2 <= T.
Proof. 
  intros HT Hy. assert (A : 0 <= 3 * y - y ^ 3 <= 2).
  { assert (0 <= y * y <= 1) by nra. split; [nra|]. assert (0 <= (1 - y) ^ 2 * (2 + y)) by (apply Rmult_le_pos; [apply pow2_ge_0|lra]). nra. }
  split; nra.
Qed.
Lemma unit_free_rises y : 0 <= y <= 1 -> 0 <= 3 - 3 * y ^ 2.
Proof. intros. nra. Qed.

(** Erosion's response (6.1): range, ends. *)
Definition e (rho sg b : R) := sg * (1 - rho) * (1 - b) + sg * b.
Lemma e_range rho sg b : 0<=rho<=1 -> 0<=sg<=1 -> 0<=b<=1 -> 0 <= e rho sg b <= 1.
Proof.
  intros A B C. unfold e.
  replace (sg * (1 - rho) * (1 - b) + sg * b) with (sg * (1 - rho * (1 - b))) by ring.
  assert (0 <= rho * (1 - b) <= 1). { split; [apply Rmult_le_pos; lra|]. replace 1 with (1*1) by ring. apply Rmult_le_compat; lra. }
  split; [apply Rmult_le_pos; lra|]. replace 1 with (1*1) by ring. apply Rmult_le_compat; lra.
Qed.
Lemma e_ends rho b : e rho 0 b = 0 /\ e 1 1 b = b /\ e 0 1 b = 1.
Proof. unfold e. repeat split; ring. Qed.
Lemma e_monotone rho rho' sg b : 0 <= sg -> 0 <= b <= 1 -> rho <= rho' -> e rho' sg b <= e rho sg b.
Proof. intros Hs Hb H. unfold e. assert (0 <= sg * (1 - b)) by (apply Rmult_le_pos; lra). nra. Qed.
(** Of a blended resistance 1.8 it is negative. *)
Lemma e_negative : e (18/10) 1 (1/10) < 0.
Proof. unfold e. lra. Qed.

(** o + 1 octaves of slope l each: t has the slope (o+1) l, whatever o; amplitudes 2^-k, frequencies 2^k (3.3). *)
Fixpoint octaves (n : R -> R) (k : nat) (p : R) : R :=
  match k with O => n p | S j => octaves n j p + / 2 ^ k * n (2 ^ k * p) end.
Lemma octaves_lip n l : (forall x y, Rabs (n x - n y) <= l * Rabs (x - y)) ->
  forall o x y, Rabs (octaves n o x - octaves n o y) <= INR (S o) * l * Rabs (x - y).
Proof.
  intros L o x y. induction o as [|o IH].
  - simpl. specialize (L x y). lra.
  - cbn [octaves]. assert (P : 0 < 2 ^ S o) by (apply pow_lt; lra).
    replace (octaves n o x + / 2 ^ S o * n (2 ^ S o * x) - (octaves n o y + / 2 ^ S o * n (2 ^ S o * y)))
      with ((octaves n o x - octaves n o y) + / 2 ^ S o * (n (2 ^ S o * x) - n (2 ^ S o * y))) by ring.
    eapply Rle_trans; [apply Rabs_triang|]. rewrite S_INR, Rmult_plus_distr_r, Rmult_plus_distr_r.
    apply Rplus_le_compat; [exact IH|]. rewrite Rabs_mult, (Rabs_pos_eq (/ 2 ^ S o)) by (left; apply Rinv_0_lt_compat; assumption).
    eapply Rle_trans. { apply Rmult_le_compat_l; [left; apply Rinv_0_lt_compat; assumption|apply L]. }
    replace (2 ^ S o * x - 2 ^ S o * y) with (2 ^ S o * (x - y)) by ring.
    rewrite Rabs_mult, (Rabs_pos_eq (2 ^ S o)) by lra.
    replace (/ 2 ^ S o * (l * (2 ^ S o * Rabs (x - y)))) with (l * Rabs (x - y)) by (field; lra). lra.
Qed.

(** The rules of hoodoos (6.3) are probabilities; the mean of a geometric count of blocks, started by its fixed point m = 1 + p m. *)
Lemma rule_probabilities p : p + (1 - p) = 1 /\ p / 2 + p / 2 + (1 - p) = 1.
Proof. split; lra. Qed.
Lemma mean_length p m : p < 1 -> m = 1 + p * m -> m = / (1 - p).
Proof. intros Hp E. apply Rmult_eq_reg_r with (1 - p); [|lra]. rewrite Rinv_l by lra. lra. Qed.
Lemma no_mean_at_one m : m <> 1 + 1 * m.
Proof. lra. Qed.

(** A perturbed radius R + t stays positive (5.2) for noise in [0, 1], and need not for signed noise. *)
Lemma radius_positive r t : 0 < r -> 0 <= t -> 0 < r + t.
Proof. lra. Qed.
Lemma radius_signed_false : exists r t, 0 < r /\ -1 - 1/2 - 1/4 <= t /\ r + t < 0.
Proof. exists 1, (- (3/2)). lra. Qed.
