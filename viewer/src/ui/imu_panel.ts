// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
import type { ImuStatus } from "../text_messages";
import { byId, setText } from "./dom";

/** Of a map that is level, in its frame, where z points up. */
const LEVEL_Z = -Math.cos(0.02);

/** What the IMU of a session measures and tells; nothing of one without. */
export class ImuPanel {
  show(imu: ImuStatus | undefined): void {
    byId("imu").hidden = !imu;
    if (!imu) return;
    setText(byId("imu-rate"), imu.rate_hz === null ? "" : `${imu.rate_hz.toFixed(0)} Hz`);
    setText(byId("imu-fault"), faultOf(imu));
    byId("imu-facts").hidden = !imu.is_used;
    setText(byId("imu-speed"), imu.velocity_m_s ? `${Math.hypot(...imu.velocity_m_s).toFixed(2)} m/s` : "–");
    setText(byId("imu-level"), !imu.gravity ? "–" : imu.gravity[2]! < LEVEL_Z ? "yes, z up" : "not yet");
  }
}

function faultOf({ is_used, reason }: ImuStatus): string {
  if (is_used) return "";
  return reason ? `Not used: ${reason}` : "Not compared with the images yet";
}
