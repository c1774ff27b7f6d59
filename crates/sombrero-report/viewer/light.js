// The lamps of the page's pictures (crate sombrero-render, light.rs): they move with the eye.

import { AmbientLight, Color, DirectionalLight, Group, HemisphereLight } from 'three';

/** Directions in view coordinates, and linear colours. */
const LAMPS = [
  [[-0.62, 0.62, 0.48], [0.92, 0.88, 0.82]],
  [[0.85, 0.1, 0.55], [0.24, 0.26, 0.3]],
  [[0.25, 0.75, -0.6], [0.3, 0.3, 0.32]],
];
const SKY = [0.27, 0.28, 0.3];
const GROUND = [0.09, 0.085, 0.08];

export class Rig extends Group {
  constructor() {
    super();
    this.even = new AmbientLight();
    this.lamps = LAMPS.map(([direction, color]) => {
      const lamp = new DirectionalLight(new Color(...color));
      lamp.position.set(...direction);
      return lamp;
    });
    this.lamps.push(new HemisphereLight(new Color(...SKY), new Color(...GROUND)));
    this.add(this.even, ...this.lamps);
    this.soften(false);
  }

  /** Evened out, so that a colour that carries a number stays readable. Three divides reflected light by π. */
  soften(soft) {
    this.even.intensity = soft ? 0.45 * Math.PI : 0;
    for (const lamp of this.lamps) lamp.intensity = soft ? 0.55 * Math.PI : Math.PI;
  }
}
