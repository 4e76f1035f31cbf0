// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
import { MathUtils, PerspectiveCamera, Vector3 } from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

export const VIEWS = ["follow", "orbit", "top"] as const;
export type ViewName = (typeof VIEWS)[number];

const FOV_DEG = 50;
/** From above the lens is so long that the picture is a plan. */
const TOP_FOV_DEG = 5;
const MOVE_S = 0.7;
/** Time in which the view catches up with most of the way to a moving camera. */
const FOLLOW_S = 0.25;

/** The camera that looks at the scene, and how it is moved. */
export class View {
  readonly camera = new PerspectiveCamera(FOV_DEG, 1, 0.01, 1000);
  name: ViewName = "orbit";
  readonly controls: OrbitControls;
  private readonly subject = new Vector3();
  private readonly step = new Vector3();
  private readonly fromPosition = new Vector3();
  private readonly fromTarget = new Vector3();
  private readonly toPosition = new Vector3();
  private readonly toTarget = new Vector3();
  private moveTime = MOVE_S;
  /** All that moves with the subject. */
  private readonly carried: Vector3[];

  constructor(element: HTMLElement) {
    this.camera.position.set(4, 5, 8);
    this.controls = new OrbitControls(this.camera, element);
    this.controls.enableDamping = true;
    this.controls.dampingFactor = 0.12;
    this.controls.zoomSpeed = 0.8;
    this.carried = [
      this.camera.position, this.controls.target, this.toPosition, this.toTarget, this.fromPosition, this.fromTarget,
    ];
    this.controls.addEventListener("start", () => (this.moveTime = MOVE_S));
  }

  /** Sees `subject` from behind, `distance` away, and keeps with it. */
  follow(subject: Vector3, heading: Vector3, distance: number): void {
    this.name = "follow";
    this.setLens(FOV_DEG);
    this.limitTilt(0, Math.PI * 0.95);
    this.subject.copy(subject);
    this.toTarget.copy(subject);
    this.toPosition.copy(heading).setY(0);
    if (this.toPosition.lengthSq() < 1e-6) this.toPosition.set(0, 0, -1);
    this.toPosition.normalize().multiplyScalar(-distance).setY(0.6 * distance).add(subject);
    this.startMove();
  }

  /** Turns about the middle of a sphere that is wholly in sight. */
  orbit(centre: Vector3, radius: number): void {
    this.name = "orbit";
    this.setLens(FOV_DEG);
    this.limitTilt(0, Math.PI * 0.95);
    this.toTarget.copy(centre);
    this.toPosition.subVectors(this.camera.position, this.controls.target).setY(0);
    if (this.toPosition.lengthSq() < 1e-6) this.toPosition.set(0.5, 0, 1);
    this.toPosition.normalize().setY(0.75).setLength(this.distanceFor(radius)).add(centre);
    this.startMove();
  }

  /** Looks straight down on a sphere, like a plan. */
  top(centre: Vector3, radius: number): void {
    this.name = "top";
    this.setLens(TOP_FOV_DEG);
    this.limitTilt(0, 0);
    this.toTarget.copy(centre);
    this.toPosition.set(0, this.distanceFor(radius), 1e-4 * radius).add(centre);
    this.startMove();
  }

  /** Goes to a place without turning. */
  goTo(place: Vector3, distance: number): void {
    this.toTarget.copy(place);
    this.toPosition.subVectors(this.camera.position, this.controls.target);
    if (this.name !== "top") this.toPosition.setLength(distance);
    this.toPosition.add(place);
    this.startMove();
    this.subject.copy(place);
  }

  /** One step; true where the picture changes. */
  update(dt_s: number, subject: Vector3 | null, radius: number): boolean {
    if (this.name === "follow" && subject) {
      this.step.subVectors(subject, this.subject).multiplyScalar(1 - Math.exp(-dt_s / FOLLOW_S));
      if (this.step.lengthSq() > 1e-12 * radius * radius) {
        this.subject.add(this.step);
        for (const point of this.carried) point.add(this.step);
      }
    }
    if (this.moveTime < MOVE_S) {
      this.moveTime = Math.min(MOVE_S, this.moveTime + dt_s);
      const t = MathUtils.smootherstep(this.moveTime / MOVE_S, 0, 1);
      this.camera.position.lerpVectors(this.fromPosition, this.toPosition, t);
      this.controls.target.lerpVectors(this.fromTarget, this.toTarget, t);
    }
    const distance = this.camera.position.distanceTo(this.controls.target);
    const near = Math.max(distance * 0.004, 1e-5);
    const far = distance + 12 * radius;
    if (Math.abs(near - this.camera.near) > 0.2 * near || Math.abs(far - this.camera.far) > 0.2 * far) {
      this.camera.near = near;
      this.camera.far = far;
      this.camera.updateProjectionMatrix();
    }
    return this.controls.update(dt_s) || this.moveTime < MOVE_S;
  }

  setAspect(aspect: number): void {
    this.camera.aspect = aspect;
    this.camera.updateProjectionMatrix();
  }

  private distanceFor(radius: number): number {
    const half = MathUtils.degToRad(this.camera.fov / 2);
    return radius / Math.sin(Math.min(half, Math.atan(Math.tan(half) * this.camera.aspect)));
  }

  private limitTilt(low: number, high: number): void {
    this.controls.minPolarAngle = low;
    this.controls.maxPolarAngle = high;
    this.controls.screenSpacePanning = true;
  }

  /** Another focal length; the camera moves so that what it looks at stays as large. */
  private setLens(fov_deg: number): void {
    const before = Math.tan(MathUtils.degToRad(this.camera.fov / 2));
    const after = Math.tan(MathUtils.degToRad(fov_deg / 2));
    this.camera.position.sub(this.controls.target).multiplyScalar(before / after).add(this.controls.target);
    this.camera.fov = fov_deg;
    this.camera.updateProjectionMatrix();
  }

  private startMove(): void {
    this.fromPosition.copy(this.camera.position);
    this.fromTarget.copy(this.controls.target);
    this.moveTime = 0;
  }
}
