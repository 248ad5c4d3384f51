// The actions that fire an engine.

export const LEFT_ENGINE = 1;
export const MAIN_ENGINE = 2;
export const RIGHT_ENGINE = 3;
