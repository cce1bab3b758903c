From Coq Require Import Reals Lra Psatz.
Open Scope R_scope.

(** Replacement, addition, maps of the plane and level of detail (Genevaux 2015, 5.2 to 5.4 and 6): their slopes, between two points
    a distance d apart, the second marked by primes. *)

(** Clamping to [0, 1] shortens no distance it should not. model/src/real.rs: Real::clamp01. *)
Definition clamp (x : R) := Rmax 0 (Rmin 1 x).
Lemma clamp_range x : 0 <= clamp x <= 1.
Proof. unfold clamp. split; [apply Rmax_l|]. apply Rmax_lub; [lra|apply Rmin_l]. Qed.
Lemma clamp_lip x y : Rabs (clamp x - clamp y) <= Rabs (x - y).
Proof.
  unfold clamp, Rmax, Rmin. repeat destruct Rle_dec; unfold Rabs; repeat destruct Rcase_abs; lra.
Qed.
Lemma clamp_below x : 0 <= x -> clamp x <= x.
Proof. intros H. unfold clamp. apply Rmax_lub; [lra|apply Rmin_r]. Qed.

Section Combine.
Variables (t t' fa fa' fb fb' lt la lb mub M d : R).
Hypothesis Ht : 0 <= t <= 1. Hypothesis Ht' : 0 <= t' <= 1.
Hypothesis Hd : 0 <= d.
Hypothesis Lt : Rabs (t - t') <= lt * d.
Hypothesis La : Rabs (fa - fa') <= la * d.

(** First rule, from the weighted slope of B, which may be a blend that fades out: t is alpha_B clamped, so t |df_B| <= mu_B d.
    model/src/operator/replace.rs: replace_bounds, `summed`. *)
Theorem replace_weighted : t * Rabs (fb - fb') <= mub * d -> Rabs (fb' - fa') <= M ->
  Rabs (((1 - t) * fa + t * fb) - ((1 - t') * fa' + t' * fb')) <= ((1 - t) * la + mub + lt * M) * d.
Proof.
  intros Hb HM.
  replace (((1 - t) * fa + t * fb) - ((1 - t') * fa' + t' * fb'))
    with ((1 - t) * (fa - fa') + t * (fb - fb') + (t - t') * (fb' - fa')) by ring.
  eapply Rle_trans; [apply Rabs_triang|]. eapply Rle_trans; [apply Rplus_le_compat_r, Rabs_triang|].
  rewrite !Rabs_mult, (Rabs_pos_eq t), (Rabs_pos_eq (1 - t)) by lra.
  assert ((1 - t) * Rabs (fa - fa') <= (1 - t) * (la * d)) by (apply Rmult_le_compat_l; lra).
  assert (Rabs (t - t') * Rabs (fb' - fa') <= (lt * d) * M) by (apply Rmult_le_compat; try apply Rabs_pos; assumption). lra.
Qed.

(** The same for an operand that is Lipschitz on its support: replace_bounds, `of_a.max(b.support_slope)`. Also the printed passage
    between levels of detail, t = (kappa - k_A)/(k_B - k_A), lt = lambda_kappa/(k_B - k_A): model/src/operator/lod.rs, lod_bounds. *)
Theorem replace_lip : Rabs (fb - fb') <= lb * d -> Rabs (fb' - fa') <= M ->
  Rabs (((1 - t) * fa + t * fb) - ((1 - t') * fa' + t' * fb')) <= (Rmax la lb + lt * M) * d.
Proof.
  intros Hb HM.
  replace (((1 - t) * fa + t * fb) - ((1 - t') * fa' + t' * fb'))
    with ((1 - t) * (fa - fa') + t * (fb - fb') + (t - t') * (fb' - fa')) by ring.
  eapply Rle_trans; [apply Rabs_triang|]. eapply Rle_trans; [apply Rplus_le_compat_r, Rabs_triang|].
  rewrite !Rabs_mult, (Rabs_pos_eq t), (Rabs_pos_eq (1 - t)) by lra.
  assert (la * d <= Rmax la lb * d) by (apply Rmult_le_compat_r; [lra|apply Rmax_l]).
  assert (lb * d <= Rmax la lb * d) by (apply Rmult_le_compat_r; [lra|apply Rmax_r]).
  assert ((1 - t) * Rabs (fa - fa') <= (1 - t) * (Rmax la lb * d)) by (apply Rmult_le_compat_l; lra).
  assert (t * Rabs (fb - fb') <= t * (Rmax la lb * d)) by (apply Rmult_le_compat_l; lra).
  assert (Rabs (t - t') * Rabs (fb' - fa') <= (lt * d) * M) by (apply Rmult_le_compat; try apply Rabs_pos; assumption). lra.
Qed.

(** model/src/operator/replace.rs: replace_bounds, weighted_slope, with `a` the weight of A. *)
Theorem replace_weighted_slope a mua : 0 <= a -> a * Rabs (fa - fa') <= mua * d -> 0 <= mua -> 
  t * Rabs (fb - fb') <= mub * d -> Rabs (fb' - fa') <= M ->
  a * Rabs (((1 - t) * fa + t * fb) - ((1 - t') * fa' + t' * fb')) <= ((1 - t) * mua + a * (mub + lt * M)) * d.
Proof.
  intros Ha Hma Hmu Hb HM.
  replace (((1 - t) * fa + t * fb) - ((1 - t') * fa' + t' * fb'))
    with ((1 - t) * (fa - fa') + (t * (fb - fb') + (t - t') * (fb' - fa'))) by ring.
  assert (X : Rabs (t * (fb - fb') + (t - t') * (fb' - fa')) <= (mub + lt * M) * d).
  { eapply Rle_trans; [apply Rabs_triang|]. rewrite !Rabs_mult, (Rabs_pos_eq t) by lra.
    assert (Rabs (t - t') * Rabs (fb' - fa') <= (lt * d) * M) by (apply Rmult_le_compat; try apply Rabs_pos; assumption). lra. }
  eapply Rle_trans; [apply Rmult_le_compat_l; [assumption|apply Rabs_triang]|].
  rewrite Rabs_mult, (Rabs_pos_eq (1 - t)) by lra.
  assert (a * ((1 - t) * Rabs (fa - fa')) <= (1 - t) * (mua * d)).
  { replace (a * ((1 - t) * Rabs (fa - fa'))) with ((1 - t) * (a * Rabs (fa - fa'))) by ring. apply Rmult_le_compat_l; lra. }
  assert (a * Rabs (t * (fb - fb') + (t - t') * (fb' - fa')) <= a * ((mub + lt * M) * d)) by (apply Rmult_le_compat_l; assumption).
  lra.
Qed.

(** model/src/operator/add.rs: add_bounds, first rule. *)
Theorem add_lip S : t * Rabs (fb - fb') <= mub * d -> Rabs fb' <= S ->
  Rabs ((fa + t * fb) - (fa' + t' * fb')) <= (la + mub + lt * S) * d.
Proof.
  intros Hb HS.
  replace ((fa + t * fb) - (fa' + t' * fb')) with ((fa - fa') + t * (fb - fb') + (t - t') * fb') by ring.
  eapply Rle_trans; [apply Rabs_triang|]. eapply Rle_trans; [apply Rplus_le_compat_r, Rabs_triang|].
  rewrite !Rabs_mult, (Rabs_pos_eq t) by lra.
  assert (Rabs (t - t') * Rabs fb' <= (lt * d) * S) by (apply Rmult_le_compat; try apply Rabs_pos; assumption). lra.
Qed.
End Combine.

(** Between its operands: the result of a replacement with a clamped weight. model/src/operator/replace.rs: replace. *)
Lemma replace_between t a b : 0 <= t <= 1 -> Rmin a b <= (1 - t) * a + t * b <= Rmax a b.
Proof.
  intros H. pose proof (Rmin_l a b). pose proof (Rmin_r a b). pose proof (Rmax_l a b). pose proof (Rmax_r a b). split; nra.
Qed.
(** With the weight 2 of a blend it is not. *)
Lemma replace_unclamped_false : (1 - 2) * 100 + 2 * 0 < Rmin 100 0.
Proof. rewrite Rmin_right; lra. Qed.

(** The slope of a product of weights: (1-t) a, t a. model/src/operator/lod.rs, lod_bounds, `scaled`; replace.rs, `old`. *)
Lemma scaled_weight_lip s s' a a' ls la d : 0 <= s <= 1 -> 0 <= a' -> 0 <= d ->
  Rabs (s - s') <= ls * d -> Rabs (a - a') <= la * d -> Rabs (s * a - s' * a') <= (s * la + ls * a') * d.
Proof.
  intros Hs Ha Hd Ls La. replace (s * a - s' * a') with (s * (a - a') + (s - s') * a') by ring.
  eapply Rle_trans; [apply Rabs_triang|]. rewrite !Rabs_mult, (Rabs_pos_eq s), (Rabs_pos_eq a') by lra.
  assert (s * Rabs (a - a') <= s * (la * d)) by (apply Rmult_le_compat_l; lra).
  assert (Rabs (s - s') * a' <= ls * d * a') by (apply Rmult_le_compat_r; lra). lra.
Qed.

(** The square of a clamped weight. model/src/operator/mod.rs: squared_weight. *)
Lemma squared_weight_lip t t' top lt d : 0 <= t <= top -> 0 <= t' <= top -> 0 <= d ->
  Rabs (t - t') <= lt * d -> Rabs (t ^ 2 - t' ^ 2) <= 2 * top * lt * d.
Proof.
  intros A B Hd L. replace (t ^ 2 - t' ^ 2) with ((t + t') * (t - t')) by ring.
  rewrite Rabs_mult, (Rabs_pos_eq (t + t')) by lra. pose proof (Rabs_pos (t - t')).
  assert ((t + t') * Rabs (t - t') <= (2 * top) * (lt * d)) by (apply Rmult_le_compat; lra). lra.
Qed.

(** Maps of the plane: distances in any sense. model/src/operator/warp.rs and affine.rs: leave_bounds. *)
Section Map.
Variables (P Q : Type) (dp : P -> P -> R) (dq : Q -> Q -> R) (map : P -> Q) (f : Q -> R) (K l : R).
Hypothesis Hl : 0 <= l.
Hypothesis HK : forall p p', dq (map p) (map p') <= K * dp p p'.
Hypothesis Lf : forall q q', Rabs (f q - f q') <= l * dq q q'.
Theorem warp_lip p p' : Rabs (f (map p) - f (map p')) <= l * K * dp p p'.
Proof.
  eapply Rle_trans; [apply Lf|]. rewrite Rmult_assoc. apply Rmult_le_compat_l; [assumption|apply HK].
Qed.
(** With a vertical scale and offset: affine.rs. *)
Theorem affine_lip s o p p' : Rabs ((s * f (map p) + o) - (s * f (map p') + o)) <= Rabs s * (l * K) * dp p p'.
Proof.
  replace ((s * f (map p) + o) - (s * f (map p') + o)) with (s * (f (map p) - f (map p'))) by ring.
  rewrite Rabs_mult, Rmult_assoc. apply Rmult_le_compat_l; [apply Rabs_pos|apply warp_lip].
Qed.
End Map.

(** id + delta is one to one, with an inverse of slope 1/(1-L), where delta is steeper than L < 1 nowhere; on the line, as along any
    direction. model/src/operator/warp.rs: Warp::new refuses the others, Warp::target inverts. *)
Theorem warp_injective (delta : R -> R) L : L < 1 ->
  (forall x y, Rabs (delta x - delta y) <= L * Rabs (x - y)) ->
  forall x y, (1 - L) * Rabs (x - y) <= Rabs ((x + delta x) - (y + delta y)).
Proof.
  intros H1 HL x y. specialize (HL x y).
  replace ((x + delta x) - (y + delta y)) with ((x - y) - - (delta x - delta y)) by ring.
  eapply Rle_trans; [|apply Rabs_triang_inv]. rewrite Rabs_Ropp. lra.
Qed.

(** The bijection x -> x^3 has an inverse that is not Lipschitz (5.4 asks for no more than a C^2 bijection). *)
Lemma cube_inverse_not_lipschitz : forall K, 0 < K -> exists q, 0 < q /\ q > K * q ^ 3.
Proof.
  intros K HK. exists (/ (1 + K)). assert (P : 0 < / (1 + K)) by (apply Rinv_0_lt_compat; lra). split; [assumption|].
  set (q := / (1 + K)) in *. assert (E : q * (1 + K) = 1) by (unfold q; field; lra).
  assert (q < 1) by nra. assert (K * q < 1) by nra. assert (K * q ^ 2 < 1) by nra. nra.
Qed.

(** A sum of octaves a_i eta(s_i p): slopes a_i s_i lambda (7.3.1 divides). model/src/noise/fractal.rs: combined_bounds. *)
Lemma octave_lip (eta : R -> R) lambda a s : 0 <= a -> 0 <= s ->
  (forall x y, Rabs (eta x - eta y) <= lambda * Rabs (x - y)) ->
  forall x y, Rabs (a * eta (s * x) - a * eta (s * y)) <= a * s * lambda * Rabs (x - y).
Proof.
  intros Ha Hs L x y. replace (a * eta (s * x) - a * eta (s * y)) with (a * (eta (s * x) - eta (s * y))) by ring.
  rewrite Rabs_mult, (Rabs_pos_eq a) by assumption.
  replace (a * s * lambda * Rabs (x - y)) with (a * (lambda * (s * Rabs (x - y)))) by ring.
  apply Rmult_le_compat_l; [assumption|]. eapply Rle_trans; [apply L|].
  replace (s * x - s * y) with (s * (x - y)) by ring. rewrite Rabs_mult, (Rabs_pos_eq s) by assumption. lra.
Qed.
Lemma octave_printed_false : exists (eta : R -> R) a s,
  (forall x y, Rabs (eta x - eta y) <= 1 * Rabs (x - y)) /\ 0 < a /\ 0 < s /\
  Rabs (a * eta (s * 1) - a * eta (s * 0)) > a * 1 / s * Rabs (1 - 0).
Proof.
  exists (fun x => x), 1, 4. repeat split; try lra. { intros. lra. } rewrite !Rabs_pos_eq; lra.
Qed.

(** A bilinear image: both components of the gradient are convex combinations of differences over one cell.
    model/src/primitive/image.rs: bounds. *)
Lemma bilinear_slope d00 d01 e00 e10 u v lx ly Mx My : 0 <= u <= 1 -> 0 <= v <= 1 -> 0 < lx -> 0 < ly ->
  Rabs d00 <= Mx -> Rabs d01 <= Mx -> Rabs e00 <= My -> Rabs e10 <= My ->
  (((1 - v) * d00 + v * d01) / lx) ^ 2 + (((1 - u) * e00 + u * e10) / ly) ^ 2 <= (Mx / lx) ^ 2 + (My / ly) ^ 2.
Proof.
  intros Hu Hv Hx Hy A B C D.
  assert (mix : forall s a b m, 0 <= s <= 1 -> Rabs a <= m -> Rabs b <= m -> Rabs ((1 - s) * a + s * b) <= m).
  { intros s a b m Hs Ha Hb. eapply Rle_trans; [apply Rabs_triang|]. rewrite !Rabs_mult, (Rabs_pos_eq s), (Rabs_pos_eq (1 - s)) by lra. nra. }
  assert (sq : forall a m l, 0 < l -> Rabs a <= m -> (a / l) ^ 2 <= (m / l) ^ 2).
  { intros a m l Hl Ha. rewrite <- !Rsqr_pow2. apply Rsqr_le_abs_1. unfold Rdiv. rewrite !Rabs_mult.
    apply Rmult_le_compat_r; [apply Rabs_pos|]. eapply Rle_trans; [apply Ha|apply Rle_abs]. }
  apply Rplus_le_compat; apply sq; auto.
Qed.

(** Where B has no weight A stays, where it has weight 1 B stands alone. model/src/operator/replace.rs: Code::prune; and the ends of a
    passage between levels of detail: lod.rs, Code::prune. *)
Lemma replace_ends a b : (1 - 0) * a + 0 * b = a /\ (1 - 1) * a + 1 * b = b.
Proof. split; ring. Qed.
Lemma passage_continuous kappa ka kb a b : ka < kb -> kappa = ka \/ kappa = kb ->
  let t := (kappa - ka) / (kb - ka) in (1 - t) * a + t * b = if Req_EM_T kappa ka then a else b.
Proof.
  intros H [E|E]; subst; cbv zeta; destruct Req_EM_T; try lra; field; lra.
Qed.
