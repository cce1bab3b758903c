From Coq Require Import Reals Lra Psatz List.
Import ListNotations.
Open Scope R_scope.

(** The slope of a blend (Genevaux 2015, 7.3.2 and appendix), without derivatives: values and weights at two points p, p' a
    distance d apart. Primes mark the second point. *)

Section Two.
Variables (a b a' b' fa fb fa' fb' la lb lfa lfb M T d : R).
Hypothesis Ha : 0 <= a. Hypothesis Hb : 0 <= b.
Hypothesis Ha' : 0 <= a'. Hypothesis Hb' : 0 <= b'.
Hypothesis HT : 0 < T.
Hypothesis HS : T <= a + b. Hypothesis HS' : T <= a' + b'.
Hypothesis Hd : 0 <= d.
Hypothesis La : Rabs (a - a') <= la * d.
Hypothesis Lb : Rabs (b - b') <= lb * d.
Let l := Rmax la lb.
Definition beta (x y : R) := x / (x + y).

(** The share of one operand: the factor 1/T that the appendix drops.
    Used by model/src/operator/blend.rs: blend_bounds, two operands (largest_crossing / t). *)
Lemma beta_lip : Rabs (beta a b - beta a' b') <= l / T * d.
Proof.
  assert (S : 0 < a + b) by lra. assert (S' : 0 < a' + b') by lra.
  assert (E : beta a b - beta a' b' = ((a - a') * b' - a' * (b - b')) / ((a + b) * (a' + b')))
    by (unfold beta; field; lra).
  rewrite E. unfold Rdiv at 1. rewrite Rabs_mult.
  rewrite (Rabs_pos_eq (/ ((a + b) * (a' + b')))) by (left; apply Rinv_0_lt_compat; nra).
  assert (N : Rabs ((a - a') * b' - a' * (b - b')) <= l * d * (a' + b')).
  { unfold Rminus at 1. eapply Rle_trans; [apply Rabs_triang|]. rewrite Rabs_Ropp, !Rabs_mult.
    rewrite (Rabs_pos_eq b'), (Rabs_pos_eq a') by lra.
    assert (X : Rabs (a - a') <= l * d). { eapply Rle_trans; [apply La|]. apply Rmult_le_compat_r; [lra|apply Rmax_l]. }
    assert (Y : Rabs (b - b') <= l * d). { eapply Rle_trans; [apply Lb|]. apply Rmult_le_compat_r; [lra|apply Rmax_r]. }
    assert (Rabs (a - a') * b' <= l * d * b') by (apply Rmult_le_compat_r; lra).
    assert (a' * Rabs (b - b') <= a' * (l * d)) by (apply Rmult_le_compat_l; lra). lra. }
  assert (P : 0 <= l * d). { eapply Rle_trans; [apply Rabs_pos|]. eapply Rle_trans; [apply La|]. apply Rmult_le_compat_r; [lra|apply Rmax_l]. }
  apply Rmult_le_reg_r with ((a + b) * (a' + b')); [nra|].
  rewrite Rmult_assoc, Rinv_l, Rmult_1_r by nra.
  eapply Rle_trans; [apply N|].
  replace (l / T * d * ((a + b) * (a' + b'))) with ((l * d) * (a' + b') * ((a + b) / T)) by (field; lra).
  rewrite <- (Rmult_1_r (l * d * (a' + b'))) at 1.
  apply Rmult_le_compat_l; [nra|]. apply Rmult_le_reg_r with T; [lra|]. unfold Rdiv. rewrite Rmult_assoc, Rinv_l; lra.
Qed.

Hypothesis Lfa : Rabs (fa - fa') <= lfa * d.
Hypothesis Lfb : Rabs (fb - fb') <= lfb * d.
Hypothesis HM : Rabs (fa' - fb') <= M.

(** model/src/operator/blend.rs: blend_bounds, two operands. *)
Theorem blend_lip :
  Rabs ((a * fa + b * fb) / (a + b) - (a' * fa' + b' * fb') / (a' + b')) <= (Rmax lfa lfb + l / T * M) * d.
Proof.
  assert (S : 0 < a + b) by lra. assert (S' : 0 < a' + b') by lra.
  assert (E : (a * fa + b * fb) / (a + b) - (a' * fa' + b' * fb') / (a' + b')
     = beta a b * (fa - fa') + (1 - beta a b) * (fb - fb') + (beta a b - beta a' b') * (fa' - fb'))
    by (unfold beta; field; lra).
  assert (B : 0 <= beta a b <= 1).
  { unfold beta. split; [apply Rmult_le_pos; [lra|left; apply Rinv_0_lt_compat; lra]|].
    apply Rmult_le_reg_r with (a + b); [lra|]. unfold Rdiv. rewrite Rmult_assoc, Rinv_l; lra. }
  rewrite E. set (L := Rmax lfa lfb).
  assert (X : Rabs (fa - fa') <= L * d). { eapply Rle_trans; [apply Lfa|]. apply Rmult_le_compat_r; [lra|apply Rmax_l]. }
  assert (Y : Rabs (fb - fb') <= L * d). { eapply Rle_trans; [apply Lfb|]. apply Rmult_le_compat_r; [lra|apply Rmax_r]. }
  pose proof beta_lip as Z.
  eapply Rle_trans; [apply Rabs_triang|]. eapply Rle_trans; [apply Rplus_le_compat_r, Rabs_triang|].
  rewrite !Rabs_mult, (Rabs_pos_eq (beta a b)), (Rabs_pos_eq (1 - beta a b)) by lra.
  assert (beta a b * Rabs (fa - fa') <= beta a b * (L * d)) by (apply Rmult_le_compat_l; lra).
  assert ((1 - beta a b) * Rabs (fb - fb') <= (1 - beta a b) * (L * d)) by (apply Rmult_le_compat_l; lra).
  assert (Rabs (beta a b - beta a' b') * Rabs (fa' - fb') <= (l / T * d) * M)
    by (apply Rmult_le_compat; try apply Rabs_pos; assumption).
  lra.
Qed.

(** Where the weights sum to 1 or more the printed bound is right. *)
Corollary printed_where_weights_are_large : 1 <= T -> 0 <= l -> 0 <= M ->
  Rabs ((a * fa + b * fb) / (a + b) - (a' * fa' + b' * fb') / (a' + b')) <= (Rmax lfa lfb + l * M) * d.
Proof.
  intros H1 Hl HM0. eapply Rle_trans; [apply blend_lip|]. apply Rmult_le_compat_r; [lra|].
  apply Rplus_le_compat_l, Rmult_le_compat_r; [lra|].
  apply Rmult_le_reg_r with T; [lra|]. unfold Rdiv. rewrite Rmult_assoc, Rinv_l; nra.
Qed.
End Two.

(** The printed statement, without 1/T, is false where the weights sum to 1/2: a rational witness. *)
Lemma printed_beta_false : exists a b a' b' l,
  0 <= a /\ 0 <= b /\ 0 <= a' /\ 0 <= b' /\ 1/2 <= a + b /\ 1/2 <= a' + b' /\
  Rabs (a - a') <= l /\ Rabs (b - b') <= l /\ Rabs (a/(a+b) - a'/(a'+b')) > l.
Proof.
  exists (1/4), (1/4), (3/8), (1/8), (1/8). repeat split; try lra; try (rewrite Rabs_left1; lra); try (rewrite Rabs_pos_eq; lra).
Qed.

(** Nor is there a constant for all pairs of positive weights: f is not Lipschitz on the whole support. *)
Lemma no_constant_on_support : forall K, 0 < K -> exists a b a' b' d,
  0 < a + b /\ 0 < a' + b' /\ 0 <= a /\ 0 <= b /\ 0 <= a' /\ 0 <= b' /\ 0 < d /\
  Rabs (a - a') <= d /\ Rabs (b - b') <= d /\ Rabs (a/(a+b) - a'/(a'+b')) > K * d.
Proof.
  intros K HK. set (e := / (2 * K)). assert (He : 0 < e) by (apply Rinv_0_lt_compat; lra).
  exists e, 0, 0, e, e.
  replace (e / (e + 0) - 0 / (0 + e)) with 1 by (field; lra). rewrite (Rabs_pos_eq 1) by lra.
  replace (K * e) with (1/2) by (unfold e; field; lra).
  repeat split; try lra; [rewrite Rabs_pos_eq|rewrite Rabs_left1]; lra.
Qed.

(** n operands. *)
Record operand := { w : R; w' : R; f : R; f' : R; lw : R; lf : R; mu : R; m : R }.

Definition sum (g : operand -> R) (l : list operand) := fold_right (fun o s => g o + s) 0 l.

Lemma sum_plus g h l : sum (fun o => g o + h o) l = sum g l + sum h l.
Proof. induction l; simpl; [lra|rewrite IHl; lra]. Qed.
Lemma sum_scale c g l : sum (fun o => c * g o) l = c * sum g l.
Proof. induction l; simpl; [lra|rewrite IHl; lra]. Qed.
Lemma sum_ext g h l : (forall o, In o l -> g o = h o) -> sum g l = sum h l.
Proof. induction l; simpl; intros H; [lra|]. rewrite (H a), IHl; auto. Qed.
Lemma sum_le g h l : (forall o, In o l -> g o <= h o) -> sum g l <= sum h l.
Proof. induction l; simpl; intros H; [lra|]. apply Rplus_le_compat; auto. Qed.
Lemma sum_abs g l : Rabs (sum g l) <= sum (fun o => Rabs (g o)) l.
Proof.
  induction l; simpl; [rewrite Rabs_R0; lra|]. eapply Rle_trans; [apply Rabs_triang|]. lra.
Qed.

Definition mean (l : list operand) := sum (fun o => w o * f o) l / sum w l.
Definition mean' (l : list operand) := sum (fun o => w' o * f' o) l / sum w' l.

(** A(f - f') = sum a_i (f_i - f'_i) + sum (a_i - a'_i)(f'_i - f'): the second sum of primed weights vanishes. *)
Lemma blend_difference l : sum w l <> 0 -> sum w' l <> 0 ->
  sum w l * (mean l - mean' l) =
  sum (fun o => w o * (f o - f' o)) l + sum (fun o => (w o - w' o) * (f' o - mean' l)) l.
Proof.
  intros S S'. set (c := mean' l).
  assert (Z : sum (fun o => w' o * f' o) l = c * sum w' l) by (unfold c, mean'; field; assumption).
  assert (E1 : sum (fun o => w o * (f o - f' o)) l = sum (fun o => w o * f o) l + -1 * sum (fun o => w o * f' o) l).
  { rewrite <- sum_scale, <- sum_plus. apply sum_ext. intros; ring. }
  assert (E2 : sum (fun o => (w o - w' o) * (f' o - c)) l =
      sum (fun o => w o * f' o) l + (-1 * sum (fun o => w' o * f' o) l + (- c * sum w l + c * sum w' l))).
  { rewrite <- !sum_scale, <- !sum_plus. apply sum_ext. intros; ring. }
  rewrite E1, E2, Z. unfold mean. field. assumption.
Qed.

Section Many.
Variables (l : list operand) (d T : R).
Hypothesis Hd : 0 <= d.
Hypothesis HT : 0 < T.
Hypothesis HS : T <= sum w l. Hypothesis HS' : T <= sum w' l.
Hypothesis Hw : forall o, In o l -> 0 <= w o.
Hypothesis Lw : forall o, In o l -> Rabs (w o - w' o) <= lw o * d.
Hypothesis Hm : forall o, In o l -> Rabs (f' o - mean' l) <= m o.

Lemma crossing_le : Rabs (sum (fun o => (w o - w' o) * (f' o - mean' l)) l) <= sum (fun o => lw o * m o) l * d.
Proof.
  eapply Rle_trans; [apply sum_abs|]. rewrite Rmult_comm, <- sum_scale. apply sum_le. intros o Ho.
  rewrite Rabs_mult. pose proof (Lw o Ho). pose proof (Hm o Ho).
  replace (d * (lw o * m o)) with ((lw o * d) * m o) by ring.
  apply Rmult_le_compat; try apply Rabs_pos; assumption.
Qed.

(** The weighted slope of a blend, which stays finite where its weight fades out.
    model/src/operator/blend.rs: blend_bounds, weighted_slope; operands may be blends themselves. *)
Theorem blend_weighted_slope :
  (forall o, In o l -> w o * Rabs (f o - f' o) <= mu o * d) ->
  sum w l * Rabs (mean l - mean' l) <= (sum mu l + sum (fun o => lw o * m o) l) * d.
Proof.
  intros Hmu. rewrite <- (Rabs_pos_eq (sum w l)) at 1 by lra. rewrite <- Rabs_mult, blend_difference by lra.
  eapply Rle_trans; [apply Rabs_triang|]. rewrite Rmult_plus_distr_r. apply Rplus_le_compat; [|apply crossing_le].
  eapply Rle_trans; [apply sum_abs|]. rewrite (Rmult_comm _ d), <- sum_scale. apply sum_le. intros o Ho.
  rewrite Rabs_mult, (Rabs_pos_eq (w o)) by auto. rewrite (Rmult_comm d). auto.
Qed.

(** Its slope where the weight is at least T: mu / T. blend_bounds, first term of `over`. *)
Theorem blend_slope_from_weighted :
  (forall o, In o l -> w o * Rabs (f o - f' o) <= mu o * d) ->
  Rabs (mean l - mean' l) <= (sum mu l + sum (fun o => lw o * m o) l) / T * d.
Proof.
  intros Hmu. pose proof (blend_weighted_slope Hmu) as H.
  apply Rmult_le_reg_l with T; [assumption|].
  replace (T * ((sum mu l + sum (fun o => lw o * m o) l) / T * d))
    with ((sum mu l + sum (fun o => lw o * m o) l) * d) by (field; lra).
  eapply Rle_trans; [|apply H]. apply Rmult_le_compat_r; [apply Rabs_pos|assumption].
Qed.

(** The sharper rule for operands that are Lipschitz on their whole support. blend_bounds, second term of `over`. *)
Theorem blend_slope_many lmax :
  (forall o, In o l -> Rabs (f o - f' o) <= lmax * d) -> 0 <= sum (fun o => lw o * m o) l ->
  Rabs (mean l - mean' l) <= (lmax + sum (fun o => lw o * m o) l / T) * d.
Proof.
  intros Hf Hc. assert (HA : 0 < sum w l) by lra.
  apply Rmult_le_reg_l with (sum w l); [assumption|].
  rewrite <- (Rabs_pos_eq (sum w l)) at 1 by lra. rewrite <- Rabs_mult, blend_difference by lra.
  eapply Rle_trans; [apply Rabs_triang|].
  assert (X : Rabs (sum (fun o => w o * (f o - f' o)) l) <= sum w l * (lmax * d)).
  { eapply Rle_trans; [apply sum_abs|]. rewrite Rmult_comm, <- sum_scale. apply sum_le. intros o Ho.
    rewrite Rabs_mult, (Rabs_pos_eq (w o)) by auto. rewrite Rmult_comm. apply Rmult_le_compat_r; auto. }
  assert (Y : sum (fun o => lw o * m o) l * d <= sum w l * (sum (fun o => lw o * m o) l / T * d)).
  { replace (sum w l * (sum (fun o => lw o * m o) l / T * d))
      with (sum (fun o => lw o * m o) l * d * (sum w l / T)) by (field; lra).
    rewrite <- (Rmult_1_r (sum _ l * d)) at 1. apply Rmult_le_compat_l; [apply Rmult_le_pos; assumption|].
    apply Rmult_le_reg_r with T; [lra|]. unfold Rdiv. rewrite Rmult_assoc, Rinv_l; lra. }
  pose proof crossing_le. replace (sum w l * ((lmax + sum (fun o => lw o * m o) l / T) * d)) with
    (sum w l * (lmax * d) + sum w l * (sum (fun o => lw o * m o) l / T * d)) by ring. lra.
Qed.
End Many.

(** A mean lies between the values it is made of: what gives `m` from ranges (model/src/bounds.rs: Bounds::spread). *)
Lemma mean_between l lo hi : 0 < sum w' l -> (forall o, In o l -> 0 <= w' o) ->
  (forall o, In o l -> lo <= f' o <= hi) -> lo <= mean' l <= hi.
Proof.
  intros S Hw Hf. unfold mean'.
  assert (A : lo * sum w' l <= sum (fun o => w' o * f' o) l).
  { rewrite <- sum_scale. apply sum_le. intros o Ho. specialize (Hw o Ho). specialize (Hf o Ho). nra. }
  assert (B : sum (fun o => w' o * f' o) l <= hi * sum w' l).
  { rewrite <- sum_scale. apply sum_le. intros o Ho. specialize (Hw o Ho). specialize (Hf o Ho). nra. }
  split; apply Rmult_le_reg_r with (sum w' l); try lra; unfold Rdiv; rewrite Rmult_assoc, Rinv_l by lra; lra.
Qed.

(** Blending two blends is blending all operands (5.1), where weights are positive. *)
Theorem blend_associative l k : sum w l <> 0 -> sum w k <> 0 -> sum w l + sum w k <> 0 ->
  (sum w l * mean l + sum w k * mean k) / (sum w l + sum w k) = mean (l ++ k).
Proof.
  intros A B C. assert (App : forall g x y, sum g (x ++ y) = sum g x + sum g y).
  { intros g x y. induction x; simpl; [lra|rewrite IHx; lra]. }
  unfold mean. rewrite !App. field. auto.
Qed.

(** And it does not matter in which order. *)
Theorem blend_commutative l k : mean (l ++ k) = mean (k ++ l).
Proof.
  assert (App : forall g x y, sum g (x ++ y) = sum g x + sum g y).
  { intros g x y. induction x; simpl; [lra|rewrite IHx; lra]. }
  unfold mean. rewrite !App. f_equal; lra.
Qed.

(** Where only one operand has weight the blend is that operand: disjoint supports give a union (5.1).
    model/src/operator/blend.rs: Code::prune drops the absent. *)
Lemma blend_alone a fa fb : 0 < a -> (a * fa + 0 * fb) / (a + 0) = fa.
Proof. intros H. field. lra. Qed.
(** But not where both have. *)
Lemma blend_not_alone : (1 * 0 + 1 * 1) / (1 + 1) <> 0.
Proof. lra. Qed.

(** The gradient of the appendix: both lines before the one that drops the factor are right. da, db, dfa, dfb are derivatives along any
    direction. *)
Lemma gradient_of_beta a b da db : 0 < a + b ->
  (da * (a + b) - a * (da + db)) / (a + b) ^ 2 = / (a + b) * ((1 - beta a b) * da - beta a b * db).
Proof. intros H. unfold beta. field. lra. Qed.
Lemma gradient_of_blend a b da db fa fb dfa dfb : 0 < a + b ->
  ((da * fa + a * dfa + db * fb + b * dfb) * (a + b) - (a * fa + b * fb) * (da + db)) / (a + b) ^ 2 =
  (fa - fb) * (/ (a + b) * ((1 - beta a b) * da - beta a b * db)) + (1 - beta a b) * dfb + beta a b * dfa.
Proof. intros H. unfold beta. field. lra. Qed.
