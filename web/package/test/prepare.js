// Makes what the tests ask about.
import {pairs} from './data.js';

for (const {name} of pairs()) console.log(name);
