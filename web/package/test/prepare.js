// Makes the data of the tests.
import {pairs} from './data.js';

for (const {name} of pairs()) console.log(name);
