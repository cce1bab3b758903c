From Coq Require Import Reals Lra Psatz Lia.
Open Scope R_scope.

(** The relaxation of Hnaidi 2010, 5.2, as an iteration F <- B F + b over cells: what diffusion/src/solver/cascade.rs, run, sweeps, and
    whose fixed point guided.rs, Guided::solve, and laplace.rs, diffuse, solve for. Every weight of B is at least 0: B is monotone,
    I - B an M-matrix. Cells are numbers below n. *)
Section Iteration.
Variable n : nat.
Variable B : nat -> nat -> R.
Variable b : nat -> R.
Hypothesis Bpos : forall i j, 0 <= B i j.

Fixpoint total (g : nat -> R) (k : nat) : R := match k with O => 0 | S j => total g j + g j end.
Definition once (x : nat -> R) (i : nat) := total (fun j => B i j * x j) n + b i.
Fixpoint iterate (k : nat) (x : nat -> R) : nat -> R := match k with O => x | S j => once (iterate j x) end.

Lemma total_le g h k : (forall j, (j < k)%nat -> g j <= h j) -> total g k <= total h k.
Proof. induction k; simpl; intros H; [lra|]. apply Rplus_le_compat; [apply IHk; intros; apply H; lia|apply H; lia]. Qed.
Lemma total_scale c g k : total (fun j => c * g j) k = c * total g k.
Proof. induction k; simpl; [ring|rewrite IHk; ring]. Qed.
Lemma total_minus g h k : total (fun j => g j - h j) k = total g k - total h k.
Proof. induction k; simpl; [ring|rewrite IHk; ring]. Qed.
Lemma total_abs g k : Rabs (total g k) <= total (fun j => Rabs (g j)) k.
Proof. induction k; simpl; [rewrite Rabs_R0; lra|]. eapply Rle_trans; [apply Rabs_triang|]. lra. Qed.

Definition below (x y : nat -> R) := forall i, (i < n)%nat -> x i <= y i.

Lemma once_monotone x y : below x y -> below (once x) (once y).
Proof.
  intros H i _. unfold once. apply Rplus_le_compat_r, total_le. intros j Hj. apply Rmult_le_compat_l; auto.
Qed.

(** From a start that one sweep raises, every sweep raises. *)
Theorem iterates_rise x : below x (once x) -> forall k, below (iterate k x) (iterate (S k) x).
Proof. intros H k. induction k; [exact H|]. apply once_monotone. exact IHk. Qed.

(** Below anything that one sweep lowers: the discrete maximum principle. *)
Theorem iterates_bounded x y : below x y -> below (once y) y -> forall k, below (iterate k x) y.
Proof.
  intros H Hy k. induction k; [exact H|]. intros i Hi. eapply Rle_trans; [|apply (Hy i Hi)]. apply (once_monotone _ _ IHk i Hi).
Qed.

(** So they converge, cell by cell. *)
Theorem iterates_converge x y : below x (once x) -> below x y -> below (once y) y ->
  forall i, (i < n)%nat -> exists l, Un_cv (fun k => iterate k x i) l /\ l <= y i.
Proof.
  intros Hx Hxy Hy i Hi.
  destruct (Un_cv_crit (fun k => iterate k x i)) as [l Hl].
  - intros k. apply (iterates_rise x Hx k i Hi).
  - exists (y i). intros v [k Hk]. subst. apply (iterates_bounded x y Hxy Hy k i Hi).
  - exists l. split; [exact Hl|]. apply Rle_cv_lim with (fun k => iterate k x i) (fun _ => y i); [|exact Hl|].
    + intros k. apply (iterates_bounded x y Hxy Hy k i Hi).
    + intros eps He. exists O. intros m _. unfold R_dist. rewrite Rminus_diag_eq by reflexivity. rewrite Rabs_R0. exact He.
Qed.

(** With row sums at most q < 1 an error shrinks by q each sweep: what approximated constraints give. *)
Theorem contraction q e x y : 0 <= q -> (forall i, (i < n)%nat -> total (B i) n <= q) -> 0 <= e ->
  (forall i, (i < n)%nat -> Rabs (x i - y i) <= e) ->
  forall k i, (i < n)%nat -> Rabs (iterate k x i - iterate k y i) <= q ^ k * e.
Proof.
  intros Hq Hrow He H k. induction k; intros i Hi; [simpl; rewrite Rmult_1_l; auto|].
  cbn [iterate]. unfold once.
  replace (total (fun j => B i j * iterate k x j) n + b i - (total (fun j => B i j * iterate k y j) n + b i))
    with (total (fun j => B i j * iterate k x j - B i j * iterate k y j) n) by (rewrite total_minus; ring).
  eapply Rle_trans; [apply total_abs|].
  assert (P : 0 <= q ^ k * e) by (apply Rmult_le_pos; [apply pow_le; assumption|assumption]).
  eapply Rle_trans.
  - apply (total_le _ (fun j => (q ^ k * e) * B i j)). intros j Hj.
    rewrite <- Rmult_minus_distr_l, Rabs_mult, (Rabs_pos_eq (B i j)) by auto. rewrite Rmult_comm.
    apply Rmult_le_compat_r; auto.
  - rewrite total_scale. simpl. specialize (Hrow i Hi).
    replace (q * q ^ k * e) with ((q ^ k * e) * q) by ring. apply Rmult_le_compat_l; assumption.
Qed.

(** The maximum principle for Laplace rows (A, R): with row sums 1 and no source, values stay within those of the start. *)
Theorem maximum_principle m x : (forall i, (i < n)%nat -> total (B i) n = 1) -> (forall i, b i = 0) ->
  (forall i, (i < n)%nat -> x i <= m) -> forall k i, (i < n)%nat -> iterate k x i <= m.
Proof.
  intros Hrow Hb H k. apply (iterates_bounded x (fun _ => m) H). intros i Hi. unfold once. rewrite Hb, Rplus_0_r.
  eapply Rle_trans; [apply (total_le _ (fun j => m * B i j)); intros; lra|].
  rewrite total_scale, Hrow by assumption. lra.
Qed.
End Iteration.

(** A crack without an elevation constraint, which 3.2 allows: equal cells, alpha = beta = 1/2, G = 1 rise by 1/2 in every sweep. *)
Theorem no_elevation_no_convergence : forall k x, iterate 1 (fun _ _ => 1) (fun _ => 1/2) k (fun _ => x) 0%nat = x + INR k / 2.
Proof.
  induction k; intros x; [simpl; lra|]. cbn [iterate]. unfold once. simpl total. rewrite IHk, S_INR. lra.
Qed.

(** The gradient step (eq. 2) on a linear field of slope G = 1 along the unit normal: what is missing of it as printed, and that the
    weights |n_x|, |n_y| miss nothing. diffusion/src/solver/guided.rs: Update::Printed, Update::Corrected. *)
Lemma gradient_step_error nx ny : nx ^ 2 * (- nx) + ny ^ 2 * (- ny) + 1 = 1 - (nx ^ 3 + ny ^ 3).
Proof. ring. Qed.
Lemma gradient_step_corrected nx ny : nx ^ 2 + ny ^ 2 = 1 -> 0 < nx + ny -> (nx * (- nx) + ny * (- ny) + 1) / (nx + ny) = 0.
Proof. intros H P. replace (nx * - nx + ny * - ny + 1) with 0 by nra. field. lra. Qed.
Lemma gradient_step_printed_false : 1 - ((3/5) ^ 3 + (4/5) ^ 3) > 1/4.
Proof. lra. Qed.
